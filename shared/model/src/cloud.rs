//! The semantic point cloud: every surface point knows its component, its defects and how sure the system is.
//!
//! The columns of a point are listed once, in the call of `semantic_columns!` below: from it come [`SemanticPoint`],
//! [`SemanticCloud`] and [`POINT_COLUMNS`], the table by which PLY files are written and read.

use super::Color;
use super::column::{ColumnValue, PointColumn};

/// Bits of a point's `flags`: filters mark, exports choose; nothing is thrown away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PointFlags(pub u16);

impl PointFlags {
    /// Fewer neighbours within a radius than expected.
    pub const RADIUS_OUTLIER: u16 = 1 << 0;
    /// Mean neighbour distance far above that of the whole model.
    pub const STATISTICAL_OUTLIER: u16 = 1 << 1;
    /// Outside the measuring volume (the table and what holds it, for instance).
    pub const BACKGROUND: u16 = 1 << 2;
    /// No evidence for any component class.
    pub const UNLABELLED: u16 = 1 << 3;
    /// Seen only by flying pixels: at depth steps, where a pixel's depth is that of neither surface.
    pub const EDGE: u16 = 1 << 4;
    /// A noisy double of a surface that is much better known: off it by no more than its own noise explains.
    pub const NOISE: u16 = 1 << 5;
    /// Seen only by pixels whose class was too uncertain, where such pixels are dropped.
    pub const UNCERTAIN: u16 = 1 << 6;
    /// Vertices of a mesh only: what lies beyond was not observed.
    pub const BOUNDARY: u16 = 1 << 15;
    /// Any of the outlier marks.
    pub const OUTLIER: u16 = Self::RADIUS_OUTLIER | Self::STATISTICAL_OUTLIER | Self::EDGE | Self::NOISE;
    /// The marks that keep a point out of meshes and scenes.
    pub const LEFT_OUT: u16 = Self::OUTLIER | Self::BACKGROUND | Self::UNCERTAIN;

    /// Whether any of `bits` is set.
    pub fn has(self, bits: u16) -> bool {
        self.0 & bits != 0
    }
}

/// Defines [`SemanticPoint`], [`SemanticCloud`] and [`POINT_COLUMNS`] from one list of columns.
///
/// An entry is `field / column: type = value where unknown, [names of its numbers in files];`.
macro_rules! semantic_columns {
    ($($(#[doc = $doc:literal])+ $field:ident / $column:ident: $kind:ty = $unknown:expr, [$($number:literal),+];)+) => {
        /// One point of a [`SemanticCloud`].
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct SemanticPoint {
            $($(#[doc = $doc])+ pub $field: $kind,)+
        }

        impl SemanticPoint {
            /// A point of which nothing is known.
            pub const UNKNOWN: Self = Self { $($field: $unknown,)+ };
        }

        /// Semantic points as parallel columns, all of one length. Metres, table frame unless said otherwise.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct SemanticCloud {
            $($(#[doc = $doc])+ pub $column: Vec<$kind>,)+
        }

        /// The columns of a point, in the order in which files hold them.
        pub const POINT_COLUMNS: &[PointColumn] = &[$(
            PointColumn {
                name: stringify!($field),
                number_names: &[$($number),+],
                number_type: <$kind as ColumnValue>::NUMBER_TYPE,
                append: |point, bytes| point.$field.append(bytes),
                set: |point, number, value| point.$field.set(number, value),
            },
        )+];

        impl SemanticCloud {
            /// An empty cloud with room for `n` points.
            pub fn with_capacity(n: usize) -> Self {
                Self { $($column: Vec::with_capacity(n),)+ }
            }

            /// Appends a point.
            pub fn push(&mut self, p: SemanticPoint) {
                $(self.$column.push(p.$field);)+
            }

            /// Point `i`, or `None` past the end.
            pub fn get(&self, i: usize) -> Option<SemanticPoint> {
                (i < self.len()).then(|| SemanticPoint { $($field: self.$column[i],)+ })
            }

            /// Replaces point `i`; nothing happens past the end.
            pub fn set(&mut self, i: usize, p: SemanticPoint) {
                if i < self.len() {
                    $(self.$column[i] = p.$field;)+
                }
            }

            /// Appends every point of `other`.
            pub fn extend_from(&mut self, other: &Self) {
                $(self.$column.extend_from_slice(&other.$column);)+
            }
        }
    };
}

semantic_columns! {
    /// Position in metres, table frame.
    position / positions: [f32; 3] = [0.0; 3], ["x", "y", "z"];
    /// Unit outward normal, or zero where unknown.
    normal / normals: [f32; 3] = [0.0; 3], ["nx", "ny", "nz"];
    /// sRGB.
    color / colors: Color = [160; 3], ["red", "green", "blue"];
    /// Best component class; 0 = none.
    label / labels: u16 = 0, ["label"];
    /// Share of the best component class, 0..=1.
    confidence / confidence: f32 = 0.0, ["confidence"];
    /// Best defect class; 0 = none.
    defect / defects: u16 = 0, ["defect"];
    /// Share of the best defect class, 0..=1.
    defect_confidence / defect_confidence: f32 = 0.0, ["defect_confidence"];
    /// Uncertainty of the component label (`sqrt(sum_c u_c^2)`), 0..=1.
    sigma / sigma: f32 = 0.0, ["sigma"];
    /// Uncertainty of the defect label, 0..=1.
    defect_sigma / defect_sigma: f32 = 0.0, ["defect_sigma"];
    /// Instance of the component; 0 = not separated.
    instance / instances: u16 = 0, ["instance"];
    /// Number of views that saw the point.
    views / views: u16 = 1, ["views"];
    /// Marks, see [`PointFlags`].
    flags / flags: PointFlags = PointFlags(0), ["flags"];
}

impl SemanticCloud {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// All points in order.
    pub fn iter(&self) -> impl Iterator<Item = SemanticPoint> + '_ {
        (0..self.len()).filter_map(|i| self.get(i))
    }
}

impl FromIterator<SemanticPoint> for SemanticCloud {
    fn from_iter<I: IntoIterator<Item = SemanticPoint>>(points: I) -> Self {
        let mut cloud = Self::default();
        cloud.extend(points);
        cloud
    }
}

impl Extend<SemanticPoint> for SemanticCloud {
    fn extend<I: IntoIterator<Item = SemanticPoint>>(&mut self, points: I) {
        for p in points {
            self.push(p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_writes_and_sets_every_number_of_a_point() {
        let point = SemanticPoint {
            position: [1.5, -2.0, 0.25],
            color: [1, 2, 3],
            flags: PointFlags(0x8001),
            ..SemanticPoint::UNKNOWN
        };
        let (mut bytes, mut copy) = (Vec::new(), SemanticPoint { views: 9, ..SemanticPoint::UNKNOWN });
        for column in POINT_COLUMNS {
            (column.append)(&point, &mut bytes);
        }
        let length: usize = POINT_COLUMNS.iter().map(|c| c.number_names.len() * c.number_type.size()).sum();
        assert_eq!((bytes.len(), length), (53, 53));
        let values = [1.5, -2.0, 0.25, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 32769.0];
        let numbers = POINT_COLUMNS.iter().flat_map(|c| (0..c.number_names.len()).map(move |k| (c, k)));
        for ((column, number), value) in numbers.zip(values) {
            (column.set)(&mut copy, number, value);
        }
        assert_eq!(copy, point);
    }

    #[test]
    fn columns_stay_of_one_length() {
        let mut cloud: SemanticCloud = std::iter::repeat_n(SemanticPoint::UNKNOWN, 2).collect();
        let labelled = SemanticPoint { label: 3, ..SemanticPoint::UNKNOWN };
        cloud.set(1, labelled);
        cloud.set(2, labelled);
        cloud.extend_from(&cloud.clone());
        assert_eq!((cloud.labels.as_slice(), cloud.flags.len()), (&[0, 3, 0, 3][..], 4));
        assert_eq!((cloud.get(3), cloud.get(4)), (Some(labelled), None));
    }
}
