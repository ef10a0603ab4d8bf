//! What is cut away from the model: beyond a plane, and outside of a box. It holds for the picture, and for what can be picked.

/// The part of space that is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// What lies beyond this plane is cut away: its unit normal, and its distance from the origin of the table frame along that,
    /// metres.
    pub plane: Option<([f32; 3], f32)>,
    /// What lies outside of this box is: its lowest and highest corner, metres, table frame.
    pub limits: Option<[[f32; 3]; 2]>,
}

impl Cut {
    /// Whether a place (metres, table frame) is shown.
    pub fn keeps(&self, place: [f32; 3]) -> bool {
        let beyond = self.plane.is_some_and(|(normal, offset)| dot(normal, place) > offset);
        let inside = |[low, high]: [[f32; 3]; 2]| (0..3).all(|k| place[k] >= low[k] && place[k] <= high[k]);
        !beyond && self.limits.is_none_or(inside)
    }

    /// Whether the plane is seen from the side that is cut away, where the eye is at a place (metres, table frame).
    pub fn opens_toward(&self, eye: [f32; 3]) -> bool {
        self.plane.is_some_and(|(normal, offset)| dot(normal, eye) > offset)
    }

    /// Whether anything may be cut away.
    pub fn is_on(&self) -> bool {
        self.plane.is_some() || self.limits.is_some()
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_plane_or_outside_of_the_box_is_not_kept() {
        let nothing = Cut::default();
        assert!(nothing.keeps([9.0; 3]) && !nothing.is_on() && !nothing.opens_toward([9.0; 3]));
        let plane = Cut { plane: Some(([0.0, 0.0, 1.0], 0.1)), ..Cut::default() };
        assert!(plane.keeps([5.0, 5.0, 0.1]) && !plane.keeps([0.0, 0.0, 0.2]));
        assert!(plane.opens_toward([0.0, 0.0, 1.0]) && !plane.opens_toward([0.0; 3]));
        let both = Cut { limits: Some([[-1.0; 3], [1.0; 3]]), ..plane };
        assert!(both.keeps([0.5, -1.0, 0.0]) && !both.keeps([0.5, -1.1, 0.0]) && !both.keeps([0.0, 0.0, 0.5]));
    }
}
