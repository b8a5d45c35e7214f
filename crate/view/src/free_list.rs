//! Which parts of one buffer are free: best fit, neighbours merged on return.

use std::collections::BTreeMap;
use std::ops::Range;

/// The free ranges, in whatever unit the owner counts.
#[derive(Clone, Debug)]
pub struct FreeList {
    /// Start to end of each free range; ranges never touch each other.
    free: BTreeMap<u32, u32>,
}

impl FreeList {
    /// Free from `start` to `end`.
    pub fn new(range: Range<u32>) -> Self {
        Self {
            free: BTreeMap::from_iter((!range.is_empty()).then_some((range.start, range.end))),
        }
    }

    /// Takes `count` units from the tightest range that holds them; `None` when none does.
    pub fn take(&mut self, count: u32) -> Option<Range<u32>> {
        let (&start, &end) = self
            .free
            .iter()
            .filter(|&(start, end)| end - start >= count)
            .min_by_key(|&(start, end)| end - start)?;
        self.free.remove(&start);
        if end - start > count {
            self.free.insert(start + count, end);
        }
        Some(start..start + count)
    }

    /// Returns what [`FreeList::take`] gave.
    pub fn give_back(&mut self, range: Range<u32>) {
        let mut range = range;
        if let Some(end) = self.free.remove(&range.end) {
            range.end = end;
        }
        let before = self.free.range(..range.start).next_back();
        if let Some((&start, &end)) = before
            && end == range.start
        {
            range.start = start;
        }
        self.free.insert(range.start, range.end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_tightest_gap_and_merges_neighbours() {
        let mut list = FreeList::new(0..100);
        let [a, b, c, d] = [10, 5, 20, 65].map(|count| list.take(count).unwrap());
        assert_eq!(
            [&a, &b, &c, &d],
            [&(0..10), &(10..15), &(15..35), &(35..100)]
        );
        assert_eq!(list.take(1), None);

        list.give_back(a.clone());
        list.give_back(c.clone());
        // 8 fits both gaps; the smaller one is used.
        assert_eq!(list.take(8), Some(0..8));
        list.give_back(0..8);

        list.give_back(b);
        // 0..35 is one gap again.
        assert_eq!(list.take(35), Some(0..35));
        list.give_back(0..35);
        list.give_back(d);
        assert_eq!(list.take(100), Some(0..100));
    }

    #[test]
    fn never_hands_out_the_same_unit_twice() {
        let mut list = FreeList::new(0..1000);
        let mut held: Vec<Range<u32>> = Vec::new();
        let mut owner = vec![false; 1000];
        let mut seed = 7u32;
        for _ in 0..20_000 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let roll = seed >> 16;
            if roll.is_multiple_of(3) && !held.is_empty() {
                let range = held.swap_remove(roll as usize % held.len());
                range.clone().for_each(|i| owner[i as usize] = false);
                list.give_back(range);
            } else if let Some(range) = list.take(1 + roll % 40) {
                for i in range.clone() {
                    assert!(!owner[i as usize], "{i} is held twice");
                    owner[i as usize] = true;
                }
                held.push(range);
            }
        }
        held.into_iter().for_each(|range| list.give_back(range));
        assert_eq!(list.take(1000), Some(0..1000));
    }
}
