//! Which requests come from pages of other sites: by the name that the server is called, and by their origin.
//!
//! A page may be given a name whose address is changed to that of this computer. What it asks then has that name.
//! Addresses cannot be changed so.

use super::http::text_of;
use super::refusal::Refusal;
use axum::http::uri::Authority;
use axum::http::{HeaderMap, Method, StatusCode, header};
use std::net::{IpAddr, SocketAddr};

/// Names of every server of this computer; the last is that of a client whose proxy it is.
const USUAL: [&str; 2] = ["localhost", "nova.astrometry.net"];

/// The names of the server.
pub(super) struct Hosts {
    stated: Vec<String>,
    /// Whether other names are refused.
    are_all: bool,
}

impl Hosts {
    /// Other computers have their own names for a server: it refuses others only where its names are `stated`.
    pub(super) fn new(listen: SocketAddr, stated: Vec<String>) -> Self {
        Self {
            are_all: listen.ip().is_loopback() || !stated.is_empty(),
            stated,
        }
    }

    /// Refuses what pages of other sites ask.
    pub(super) fn check(&self, method: &Method, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = text_of(headers, header::HOST);
        if self.are_all && headers.contains_key(header::HOST) && !self.has(host) {
            let message =
                "the server is not called by this name; it can be given with the option --host";
            return Err(Refusal::new(StatusCode::MISDIRECTED_REQUEST, message));
        }
        let is_foreign = match headers.get("sec-fetch-site") {
            Some(site) => site == "cross-site",
            // Browsers tell this of addresses without TLS, too.
            None => {
                headers.contains_key(header::ORIGIN) && {
                    let origin = text_of(headers, header::ORIGIN);
                    let authority = origin
                        .split_once("://")
                        .map_or("", |(_, authority)| authority);
                    authority != host && !self.is_stated(authority)
                }
            }
        };
        if is_foreign && method == Method::POST {
            let message = "pages of other sites may not use this server";
            return Err(Refusal::new(StatusCode::FORBIDDEN, message));
        }
        Ok(())
    }

    fn has(&self, host: &str) -> bool {
        let name = name_of(host);
        let is_address = name.trim_matches(['[', ']']).parse::<IpAddr>().is_ok();
        is_address || USUAL.contains(&&*name) || self.is_stated(host)
    }

    fn is_stated(&self, host: &str) -> bool {
        let name = name_of(host);
        self.stated
            .iter()
            .any(|stated| stated.eq_ignore_ascii_case(&name))
    }
}

/// A host without its port, in small letters; empty where it is none.
fn name_of(host: &str) -> String {
    let authority = host.parse::<Authority>();
    authority.map_or_else(|_| String::new(), |found| found.host().to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(listen: &str, stated: &[&str], headers: &[(&'static str, &str)]) -> Option<u16> {
        let stated = stated.iter().map(ToString::to_string).collect();
        let hosts = Hosts::new(listen.parse().unwrap(), stated);
        let headers = headers.iter().map(|(name, value)| {
            let name = header::HeaderName::from_static(name);
            (name, value.parse().unwrap())
        });
        let checked = hosts.check(&Method::POST, &headers.collect());
        checked.err().map(|refusal| refusal.status.as_u16())
    }

    #[test]
    fn a_server_of_this_computer_has_no_other_name() {
        let at = |host| check("127.0.0.1:80", &["Proxy.example"], &[("host", host)]);
        for host in [
            "127.0.0.1",
            "127.0.0.1:8080",
            "[::1]:8080",
            "192.168.1.2",
            "LOCALHOST:1",
            "nova.astrometry.net",
            "proxy.example:443",
        ] {
            assert_eq!(at(host), None, "{host}");
        }
        for host in [
            "",
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil",
            "a b",
        ] {
            assert_eq!(at(host), Some(421), "{host}");
        }
        // Others have their own name for it.
        assert_eq!(check("0.0.0.0:80", &[], &[("host", "nas.local")]), None);
        assert_eq!(check("0.0.0.0:80", &["a"], &[("host", "nas")]), Some(421));
    }

    #[test]
    fn origins_are_compared_where_browsers_tell_no_site() {
        let host = ("host", "192.168.1.2:8080");
        let from = |more: &[_]| check("0.0.0.0:8080", &[], &[&[host], more].concat());
        assert_eq!(from(&[]), None);
        assert_eq!(from(&[("origin", "http://192.168.1.2:8080")]), None);
        for origin in ["http://evil.example", "http://192.168.1.2", "null", ""] {
            assert_eq!(from(&[("origin", origin)]), Some(403), "{origin}");
        }
        assert_eq!(from(&[("sec-fetch-site", "cross-site")]), Some(403));
        let own = [("origin", "null"), ("sec-fetch-site", "same-origin")];
        assert_eq!(from(&own), None);
        let headers = [
            ("host", "proxy.example"),
            ("origin", "https://proxy.example:444"),
        ];
        assert_eq!(check("127.0.0.1:1", &["proxy.example"], &headers), None);
    }
}
