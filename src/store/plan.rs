//! Which frames are in which part, and which parts are whose.

use super::error::StoreError;
use std::num::NonZeroUsize;
use std::str::FromStr;
use xxhash_rust::xxh3::xxh3_64;

/// Frames of a part: some seconds to minutes of work, lost at most where a worker is killed.
pub const DEFAULT_FRAMES_PER_PART: NonZeroUsize = NonZeroUsize::new(500).unwrap();

/// The frames of an archive in parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    names: Vec<String>,
    frames_per_part: NonZeroUsize,
}

/// Some of the frames, which are written together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part<'a> {
    /// Its number, from 0.
    pub number: usize,
    /// Names of its frames, in order.
    pub names: &'a [String],
}

/// One worker of several: number `index` of `count`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

/// Why a text is no shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected K/N, such as 3/100, with K from 1 to N")]
pub struct NoShard;

impl Shard {
    /// The only worker.
    pub const ALL: Self = Self { index: 1, count: 1 };

    /// Whether this worker does the part with this number.
    fn does(self, part: usize) -> bool {
        part % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = NoShard;

    fn from_str(text: &str) -> Result<Self, NoShard> {
        let (index, count) = text.split_once('/').ok_or(NoShard)?;
        let index = index.parse().map_err(|_| NoShard)?;
        let count = count.parse().map_err(|_| NoShard)?;
        if (1..=count).contains(&index) {
            Ok(Self { index, count })
        } else {
            Err(NoShard)
        }
    }
}

impl Plan {
    /// Sorts the names, leaves out repeated ones, and cuts them into parts.
    ///
    /// # Errors
    /// [`StoreError::NoFrames`].
    pub fn new(mut names: Vec<String>, frames_per_part: NonZeroUsize) -> Result<Self, StoreError> {
        names.sort_unstable();
        names.dedup();
        if names.is_empty() {
            return Err(StoreError::NoFrames);
        }
        Ok(Self {
            names,
            frames_per_part,
        })
    }

    /// The names, sorted.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Frames of a part, but for the last one.
    pub fn frames_per_part(&self) -> NonZeroUsize {
        self.frames_per_part
    }

    /// All parts.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = Part<'_>> {
        let chunks = self.names.chunks(self.frames_per_part.get()).enumerate();
        chunks.map(|(number, names)| Part { number, names })
    }

    /// The parts that a worker does.
    pub fn shard(&self, shard: Shard) -> impl Iterator<Item = Part<'_>> {
        self.parts().filter(move |part| shard.does(part.number))
    }

    /// Hash of all names.
    pub(super) fn names_hash(&self) -> String {
        format!("{:016x}", hash_of(&self.names))
    }
}

impl Part<'_> {
    /// Name of the part's files; `identity` is the content of `archive.json`.
    pub fn file_name(&self, identity: &str) -> String {
        let both = [hash_of(self.names), xxh3_64(identity.as_bytes())];
        let hash = xxh3_64(&both.map(u64::to_le_bytes).concat());
        format!("part-{:06}-{hash:016x}.parquet", self.number)
    }
}

fn hash_of(names: &[String]) -> u64 {
    // No name has a line break in it: they come from lists, one a line.
    xxh3_64(names.join("\n").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn plan(frames: usize, per_part: usize) -> Plan {
        let names = (0..frames).map(|n| format!("{n:04}.fits")).collect();
        Plan::new(names, NonZeroUsize::new(per_part).unwrap()).unwrap()
    }

    #[test]
    fn names_are_sorted_and_stand_once() {
        let names = ["b", "a", "b"].map(str::to_owned).to_vec();
        let plan = Plan::new(names, DEFAULT_FRAMES_PER_PART).unwrap();
        assert_eq!(plan.names(), ["a", "b"]);
        let none = Plan::new(vec![], DEFAULT_FRAMES_PER_PART);
        assert!(matches!(none, Err(StoreError::NoFrames)));
    }

    #[test]
    fn shards_are_read_as_k_of_n() {
        assert_eq!(
            "3/100".parse(),
            Ok(Shard {
                index: 3,
                count: 100
            })
        );
        for wrong in ["", "3", "0/4", "5/4", "-1/4", "1/0", "1/2/3", "a/b"] {
            assert_eq!(wrong.parse::<Shard>(), Err(NoShard), "{wrong}");
        }
    }

    #[test]
    fn the_name_of_a_part_depends_on_its_frames_and_on_the_configuration() {
        let (plan, other) = (plan(20, 10), plan(21, 10));
        let name = |plan: &Plan, part: usize, configuration: &str| {
            plan.parts().nth(part).unwrap().file_name(configuration)
        };
        assert_eq!(name(&plan, 0, "a"), name(&other, 0, "a"));
        assert_ne!(name(&plan, 0, "a"), name(&plan, 0, "b"));
        assert_ne!(name(&plan, 0, "a")[11..], name(&plan, 1, "a")[11..]);
    }

    proptest! {
        #[test]
        fn every_frame_is_in_one_part_of_one_shard(frames in 1usize..300, per_part in 1usize..40, count in 1usize..9) {
            let plan = plan(frames, per_part);
            let mut done: Vec<&String> = (1..=count)
                .flat_map(|index| plan.shard(Shard { index, count }))
                .flat_map(|part| part.names)
                .collect();
            done.sort();
            prop_assert!(done.into_iter().eq(plan.names()));
        }
    }
}
