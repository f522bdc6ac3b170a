//! Who may use the server: keys, and the sessions that they open.

use anyhow::{Context, bail};
use starpipe::base::files;
use std::hash::{BuildHasher, RandomState};
use std::path::Path;

/// More bytes are no list of keys.
const MAX_BYTES: u64 = 1_000_000;

/// The keys that are accepted.
pub(super) enum Keys {
    /// Any key, and any session.
    Any,
    /// Those of a file.
    Listed {
        keys: Vec<String>,
        secret: Box<[RandomState; 2]>,
    },
}

impl Keys {
    /// Reads the keys in a file, one in each line.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let text = files::read_text(path, MAX_BYTES)
            .with_context(|| format!("reading {}", path.display()))?;
        let lines = text.lines().map(str::trim);
        let keys = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
        let keys: Vec<String> = keys.map(str::to_owned).collect();
        if keys.is_empty() {
            bail!("{}: found no key", path.display());
        }
        Ok(Self::Listed {
            keys,
            secret: Box::default(),
        })
    }

    /// The session that a key opens; `None` if it is not accepted.
    pub(super) fn session(&self, key: &str) -> Option<String> {
        match self {
            Self::Any => Some("starpipe".to_owned()),
            Self::Listed { keys, secret } => {
                let known = keys.iter().find(|known| are_equal(known, key))?;
                Some(session_of(known, secret))
            }
        }
    }

    /// Whether a session was opened by a key, since the server was started.
    pub(super) fn is_session(&self, session: &str) -> bool {
        match self {
            Self::Any => true,
            Self::Listed { keys, secret } => keys
                .iter()
                .any(|key| are_equal(&session_of(key, secret), session)),
        }
    }

    /// Whether a key is accepted, or none is needed.
    pub(super) fn accepts(&self, key: Option<&str>) -> bool {
        match self {
            Self::Any => true,
            Self::Listed { .. } => key.is_some_and(|key| self.session(key).is_some()),
        }
    }
}

/// A keyed hash: nobody who does not know the secret finds the session of a key, nor a key by its session.
fn session_of(key: &str, secret: &[RandomState; 2]) -> String {
    let [first, second] = secret.each_ref().map(|state| state.hash_one(key));
    format!("{first:016x}{second:016x}")
}

/// Compares in a time that does not tell how much is right.
fn are_equal(a: &str, b: &str) -> bool {
    let bytes = a.bytes().zip(b.bytes());
    let difference = bytes.fold(0, |difference, (a, b)| difference | (a ^ b));
    a.len() == b.len() && std::hint::black_box(difference) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_listed_keys_open_sessions() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("keys");
        std::fs::write(&path, "# keys\n\nalpha\n beta \n").unwrap();
        let keys = Keys::read(&path).unwrap();
        let session = keys.session("beta").unwrap();
        assert!(keys.is_session(&session) && keys.accepts(Some("alpha")));
        assert_ne!(Some(&session), keys.session("alpha").as_ref());
        // Another start has other sessions.
        assert!(!Keys::read(&path).unwrap().is_session(&session));
        for wrong in ["", "# keys", "alph", "alphaa", "starpipe"] {
            assert_eq!(keys.session(wrong), None, "{wrong}");
            assert!(!keys.is_session(wrong) && !keys.accepts(Some(wrong)));
        }
        assert!(!keys.accepts(None) && Keys::Any.accepts(None));
        std::fs::write(&path, "#\n").unwrap();
        assert!(Keys::read(&path).is_err());
    }
}
