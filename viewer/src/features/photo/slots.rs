//! Which photographs the graphics device has. It has room for few: the one that was unused for longest makes room for another.

/// A photograph there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    /// Number of its view.
    pub(super) view: u32,
    /// Its pixels across, as a share of those that there is room for.
    pub(super) resolution: f32,
    /// Whether these are the pixels of the picture in full size.
    pub(super) is_full: bool,
    used: u64,
}

/// The places, each with a photograph or empty.
#[derive(Debug, Default)]
pub(super) struct Slots {
    places: Vec<Option<Held>>,
    uses: u64,
}

impl Slots {
    pub(super) fn new(count: u32) -> Self {
        Self { places: vec![None; count as usize], uses: 0 }
    }

    /// The place of a view's photograph, and what is there of it.
    pub(super) fn of(&self, view: u32) -> Option<(u32, Held)> {
        (0..).zip(&self.places).find_map(|(slot, held)| held.filter(|h| h.view == view).map(|held| (slot, held)))
    }

    /// These photographs are used now: none of them makes room before any other.
    pub(super) fn touch(&mut self, views: &[u32]) {
        self.uses += 1;
        for held in self.places.iter_mut().flatten().filter(|held| views.contains(&held.view)) {
            held.used = self.uses;
        }
    }

    /// The place for new pixels of a photograph: its own, an empty one, or that of the one unused for longest. `None` without any.
    pub(super) fn place(&mut self, view: u32, resolution: f32, is_full: bool) -> Option<u32> {
        let own = self.of(view).map(|(slot, _)| slot as usize);
        let empty = self.places.iter().position(Option::is_none);
        let oldest = || (0..self.places.len()).min_by_key(|slot| self.places[*slot].map(|held| held.used));
        let slot = own.or(empty).or_else(oldest)?;
        self.places[slot] = Some(Held { view, resolution, is_full, used: self.uses });
        Some(slot as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_unused_for_longest_makes_room() {
        let mut slots = Slots::new(3);
        for view in [10, 11, 12] {
            slots.touch(&[view]);
            slots.place(view, 0.25, false);
        }
        slots.touch(&[10, 12]);
        assert_eq!(slots.place(10, 1.0, true), Some(0), "its own place, with more pixels");
        assert_eq!(slots.of(10).map(|(slot, held)| (slot, held.resolution, held.is_full)), Some((0, 1.0, true)));
        slots.touch(&[13, 10]);
        assert_eq!(slots.place(13, 0.25, false), Some(1), "11 was not touched again");
        assert_eq!((slots.of(11), slots.of(12).map(|(slot, _)| slot)), (None, Some(2)));
        assert_eq!(Slots::default().place(1, 1.0, true), None, "there is no room at all");
    }
}
