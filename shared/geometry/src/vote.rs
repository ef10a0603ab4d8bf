//! Which class wins: by count, by evidence, or by a running vote.

use std::collections::BTreeMap;

/// The class that `votes` name most often; of equals the lower one. `None` without votes.
pub fn most_frequent<C: Copy + Ord>(votes: impl IntoIterator<Item = C>) -> Option<C> {
    most_frequent_of_each(votes.into_iter().map(|class| ((), class))).remove(&())
}

/// For each object the class that most of its votes name, of equals the lower one; `votes` are (object, class).
pub fn most_frequent_of_each<O: Copy + Ord, C: Copy + Ord>(votes: impl IntoIterator<Item = (O, C)>) -> BTreeMap<O, C> {
    let mut counts: BTreeMap<(O, C), u32> = BTreeMap::new();
    for vote in votes {
        *counts.entry(vote).or_default() += 1;
    }
    let mut best: BTreeMap<O, (u32, C)> = BTreeMap::new();
    for ((object, class), count) in counts {
        let most = best.entry(object).or_insert((0, class));
        if count > most.0 {
            *most = (count, class);
        }
    }
    best.into_iter().map(|(object, (_, class))| (object, class)).collect()
}

/// Index of the largest value, the first of equals; 0 where none is above `least`.
#[inline]
pub fn largest<T: Copy + PartialOrd>(values: &[T], least: T) -> usize {
    values.iter().enumerate().fold((0, least), |best, (i, &value)| if value > best.1 { (i, value) } else { best }).0
}

/// One vote of weight `weight` in a running majority vote, which needs no histogram [Boyer 1991]: `candidate` is ahead of
/// all others together by at least `lead` if any is.
#[inline]
pub fn majority_vote(candidate: &mut u16, lead: &mut f32, vote: u16, weight: f32) {
    if *candidate == vote {
        *lead += weight;
    } else if *lead >= weight {
        *lead -= weight;
    } else {
        *candidate = vote;
        *lead = weight - *lead;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_equals_the_lower_or_first_wins() {
        assert_eq!(most_frequent([3, 1, 3, 1, 2]), Some(1));
        assert_eq!(most_frequent([4, 4, 1]), Some(4));
        assert_eq!(most_frequent([0_u16; 0]), None);
        assert_eq!(largest(&[1.0, 3.0, 3.0], 0.0), 1);
        assert_eq!(largest(&[0_u8, 0], 0), 0);
        assert_eq!(most_frequent_of_each([(7, 2), (7, 2), (7, 1), (5, 9)]), BTreeMap::from([(5, 9), (7, 2)]));
    }

    #[test]
    fn a_majority_wins_the_running_vote_in_any_order() {
        let (mut candidate, mut lead) = (0, 0.0);
        for (vote, weight) in [(1, 1.0), (2, 0.7), (2, 0.8), (2, 0.6)] {
            majority_vote(&mut candidate, &mut lead, vote, weight);
        }
        assert_eq!(candidate, 2);
    }
}
