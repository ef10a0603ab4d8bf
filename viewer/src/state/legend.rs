//! The component classes: which are shown, and what the model holds of each.

use crate::display::HiddenFlags;
use semascan_model::{ClassDef, Taxonomy};
use semascan_protocol::Inspection;

/// What was counted of one component class in the model as it is held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassCount {
    /// Number of points that are part of the surface: without marks that keep them out of meshes.
    pub points: u64,
    /// Mean share of the class at these points, 0..=1.
    pub confidence: f64,
    /// Number of points that the marks which are hidden leave in the picture.
    pub shown: u64,
    /// Number of points, whatever their marks.
    pub held: u64,
    /// Number of points outside the measuring volume.
    pub background: u64,
}

/// Points of the model that the picture and exports are without, by the reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HiddenPoints {
    /// Of components that are not shown.
    pub components: u64,
    /// Marked as outliers or as too uncertain, of shown components.
    pub stray: u64,
    /// Outside the measuring volume, of shown components.
    pub background: u64,
}

/// What the legend says of a component class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassFigures {
    /// Number of points that are part of the surface.
    pub points: u64,
    /// Area of the surface that was seen, square metres; `None` until there is a mesh of it.
    pub area: Option<f64>,
    /// Mean share of the class at these points, 0..=1.
    pub confidence: f64,
}

/// One row of the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The class.
    pub class: ClassDef,
    /// Whether its points are drawn and exported.
    pub visible: bool,
    /// What was counted of it.
    pub count: ClassCount,
}

/// The component classes; row `i` is class `i`, class 0 is "none".
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Legend {
    /// The rows, in the order of the class ids.
    pub rows: Vec<Row>,
    /// The defect classes, class 0 = none first.
    pub defects: Vec<ClassDef>,
}

impl Legend {
    /// Takes the classes of an inspection. The same components as before keep their visibility; others start visible.
    pub(super) fn set_taxonomy(&mut self, inspection: &Inspection) {
        let Taxonomy { components, defects } = inspection.taxonomy();
        let same = components.len() == self.rows.len()
            && components.iter().zip(&self.rows).all(|(c, row)| c.name == row.class.name);
        let old = std::mem::take(&mut self.rows);
        let kept = |i: usize| old.get(i).filter(|_| same);
        self.rows = components
            .into_iter()
            .enumerate()
            .map(|(i, class)| Row {
                class,
                visible: kept(i).is_none_or(|row| row.visible),
                count: kept(i).map_or_else(ClassCount::default, |row| row.count),
            })
            .collect();
        self.defects = defects;
    }

    /// Takes what was counted; classes beyond the taxonomy are ignored, missing ones are empty.
    pub(super) fn set_counts(&mut self, counts: &[ClassCount]) {
        for (i, row) in self.rows.iter_mut().enumerate() {
            row.count = counts.get(i).copied().unwrap_or_default();
        }
    }

    /// The model is empty.
    pub(super) fn clear_counts(&mut self) {
        self.set_counts(&[]);
    }

    /// Shows or hides a class.
    pub(super) fn toggle(&mut self, class: u16) {
        if let Some(row) = self.rows.get_mut(usize::from(class)) {
            row.visible = !row.visible;
        }
    }

    /// Shows this class and no other; a class that does not exist changes nothing.
    pub(super) fn only(&mut self, class: u16) {
        if usize::from(class) < self.rows.len() {
            for row in &mut self.rows {
                row.visible = row.class.id == class;
            }
        }
    }

    /// Shows all classes.
    pub(super) fn show_all(&mut self) {
        for row in &mut self.rows {
            row.visible = true;
        }
    }

    /// Whether points of `class` are shown; a class that the taxonomy does not know is.
    pub fn visible(&self, class: u16) -> bool {
        self.rows.get(usize::from(class)).is_none_or(|row| row.visible)
    }

    /// Visibility by class id.
    pub fn visibility(&self) -> Vec<bool> {
        self.rows.iter().map(|row| row.visible).collect()
    }

    /// Whether every class is shown.
    pub fn all_visible(&self) -> bool {
        self.rows.iter().all(|row| row.visible)
    }

    /// The rows as they are listed: components first, "none" last.
    pub fn listed(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().skip(1).chain(self.rows.first())
    }

    /// Number of points that are shown: of visible classes, without the marks that are hidden.
    pub fn visible_points(&self) -> u64 {
        self.rows.iter().filter(|row| row.visible).fold(0, |sum, row| sum.saturating_add(row.count.shown))
    }

    /// Number of points of the model, whatever is hidden.
    pub fn held_points(&self) -> u64 {
        self.rows.iter().fold(0, |sum, row| sum.saturating_add(row.count.held))
    }

    /// The points that are hidden, by the reason.
    ///
    /// * `hidden`: the marks that hide a point.
    pub fn hidden_points(&self, hidden: HiddenFlags) -> HiddenPoints {
        let mut sum = HiddenPoints::default();
        for Row { visible, count, .. } in &self.rows {
            if !visible {
                sum.components = sum.components.saturating_add(count.held);
                continue;
            }
            let marked = count.held.saturating_sub(count.shown);
            let background = if hidden.background { count.background.min(marked) } else { 0 };
            sum.background = sum.background.saturating_add(background);
            sum.stray = sum.stray.saturating_add(marked - background);
        }
        sum
    }

    /// Number of points of visible classes that are part of the surface: what a mesh is made of.
    pub fn surface_points(&self) -> u64 {
        self.rows.iter().filter(|row| row.visible).fold(0, |sum, row| sum.saturating_add(row.count.points))
    }
}
