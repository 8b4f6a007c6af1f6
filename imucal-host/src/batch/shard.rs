//! A share of the recordings, for one machine among several.

use std::str::FromStr;

/// Every n-th recording, in the order of names: the i-th, the (i + n)-th and so on, counted from 1. All machines must see the same
/// recordings; then each of them is in one shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// The members of this shard.
    #[must_use]
    pub fn of<T>(self, all: Vec<T>) -> Vec<T> {
        all.into_iter().skip(self.index - 1).step_by(self.count).collect()
    }
}

impl FromStr for Shard {
    type Err = String;

    /// `2/3`: the second of three.
    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text
            .split_once('/')
            .and_then(|(index, count)| Some(Self { index: index.parse().ok()?, count: count.parse().ok()? }));
        parsed
            .filter(|shard| (1..=shard.count).contains(&shard.index))
            .ok_or_else(|| format!("`{text}` is no shard; expected i/n with i from 1 to n, such as 2/3"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shards_of_any_number_are_a_partition_that_differs_by_one() {
        for count in 1..9 {
            let shards: Vec<Vec<usize>> = (1..=count)
                .map(|index| Shard::from_str(&format!("{index}/{count}")).unwrap().of((0..20).collect()))
                .collect();
            let sizes = shards.iter().map(Vec::len);
            assert!(sizes.clone().max().unwrap() - sizes.min().unwrap() <= 1);
            let mut all = shards.concat();
            all.sort_unstable();
            assert_eq!(all, (0..20).collect::<Vec<_>>());
        }
    }

    #[test]
    fn what_is_no_shard_is_refused_with_an_example() {
        for text in ["", "1", "0/3", "4/3", "1/0", "-1/3", "a/b", "1/3/4"] {
            assert!(Shard::from_str(text).unwrap_err().contains("such as 2/3"), "{text}");
        }
    }
}
