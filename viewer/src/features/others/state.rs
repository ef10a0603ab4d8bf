//! Who points where, and for how long.

use super::OthersEvent;
use crate::display::Display;
use crate::features::Feature;
use semascan_protocol::Pointer;

/// Most others that are shown: more cannot be told apart.
const MOST: usize = 20;
/// Colours that people are told apart by.
const COLORS: u32 = 6;
/// How long a mark is new, and how long it stays, milliseconds.
const NEW: u32 = 4000;
const STAYS: u32 = 12_000;

/// Where somebody points.
#[derive(Clone, Debug, PartialEq)]
pub struct Other {
    /// The name of their page.
    pub viewer: String,
    /// Their own name; empty where it is not known.
    pub person: String,
    /// Metres, table frame.
    pub position: [f32; 3],
    /// Milliseconds since then.
    age: u32,
}

impl Other {
    /// Number of their colour: the same as long as they look, wherever they are shown.
    pub fn color(&self) -> u32 {
        let who = if self.person.is_empty() { &self.viewer } else { &self.person };
        // FNV-1a, whose low bits differ for names that differ little.
        who.bytes().fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)) % COLORS
    }

    /// The same as if it were just said.
    pub fn at_no_age(self) -> Self {
        Self { age: 0, ..self }
    }

    /// Whether they may point elsewhere by now.
    pub fn is_old(&self) -> bool {
        self.age >= NEW
    }
}

/// Those who look at the same inspection and point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Others {
    /// The name of this page.
    pub own: String,
    /// The others, those first who began first.
    pub list: Vec<Other>,
}

impl Feature for Others {
    type Event = OthersEvent;

    fn reduce(&mut self, event: &OthersEvent, _: &mut Display) {
        match event {
            OthersEvent::Named(name) => self.own.clone_from(name),
        }
    }

    fn begin(&mut self, _: &mut Display) {
        self.list.clear();
    }
}

impl Others {
    /// Somebody points; what this page said itself comes back, too.
    pub fn point(&mut self, pointer: &Pointer) {
        let Pointer { viewer, person, x, y, z } = pointer.clone();
        let position = [x, y, z];
        if viewer == self.own || !position.iter().all(|coordinate| coordinate.is_finite()) {
            return;
        }
        let now = Other { viewer, person, position, age: 0 };
        match self.list.iter().position(|other| other.viewer == now.viewer) {
            Some(place) => self.list[place] = now,
            None if self.list.len() < MOST => self.list.push(now),
            None => {}
        }
    }

    /// Time goes by.
    pub fn elapsed(&mut self, ms: u32) {
        self.list.iter_mut().for_each(|other| other.age = other.age.saturating_add(ms));
        self.list.retain(|other| other.age < STAYS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pointer(viewer: &str, x: f32) -> Pointer {
        Pointer { viewer: viewer.into(), person: format!("person {viewer}"), x, ..Pointer::default() }
    }

    fn shown(others: &Others) -> Vec<(&str, f32)> {
        others.list.iter().map(|other| (other.viewer.as_str(), other.position[0])).collect()
    }

    #[test]
    fn others_are_shown_at_their_latest_place_until_it_is_old() {
        let mut others = Others::default();
        others.reduce(&OthersEvent::Named("own".into()), &mut Display::default());
        for told in
            [pointer("a", 1.0), pointer("own", 2.0), pointer("b", 3.0), pointer("a", 4.0), pointer("c", f32::NAN)]
        {
            others.point(&told);
        }
        assert_eq!(shown(&others), [("a", 4.0), ("b", 3.0)]);
        others.elapsed(NEW);
        others.point(&pointer("b", 5.0));
        assert_eq!(others.list.iter().map(Other::is_old).collect::<Vec<_>>(), [true, false]);
        others.elapsed(STAYS - NEW);
        assert_eq!(shown(&others), [("b", 5.0)]);
        others.begin(&mut Display::default());
        assert!(others.list.is_empty() && others.own == "own");
    }

    #[test]
    fn there_are_not_more_than_can_be_told_apart_and_a_person_keeps_their_colour() {
        let mut others = Others::default();
        (0..100).for_each(|n| others.point(&pointer(&n.to_string(), 0.0)));
        assert_eq!(others.list.len(), MOST);
        let mut colors: Vec<u32> = others.list.iter().map(Other::color).collect();
        let again = Other { viewer: "elsewhere".into(), ..others.list[3].clone() };
        assert_eq!(again.color(), colors[3], "a colour is the person's");
        colors.sort_unstable();
        colors.dedup();
        assert!(colors.len() > 3 && colors.iter().all(|color| *color < COLORS), "{colors:?}");
    }
}
