//! The semantic point cloud: every surface point knows its component, its defects and how sure the system is.

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

/// One point of a [`SemanticCloud`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SemanticPoint {
    /// Position in metres, table frame.
    pub position: [f32; 3],
    /// Unit outward normal, or zero where unknown.
    pub normal: [f32; 3],
    /// sRGB.
    pub color: [u8; 3],
    /// Best component class; 0 = none.
    pub label: u16,
    /// Share of the best component class, 0..=1.
    pub confidence: f32,
    /// Best defect class; 0 = none.
    pub defect: u16,
    /// Share of the best defect class, 0..=1.
    pub defect_confidence: f32,
    /// Uncertainty of the component label (`sqrt(sum_c u_c^2)`), 0..=1.
    pub sigma: f32,
    /// Uncertainty of the defect label, 0..=1.
    pub defect_sigma: f32,
    /// Instance of the component; 0 = not separated.
    pub instance: u16,
    /// Number of views that saw the point.
    pub views: u16,
    /// Marks, see [`PointFlags`].
    pub flags: PointFlags,
}

/// Semantic points as parallel columns, all of one length. Metres, table frame unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SemanticCloud {
    /// Positions in metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, or zero where unknown.
    pub normals: Vec<[f32; 3]>,
    /// sRGB colours.
    pub colors: Vec<[u8; 3]>,
    /// Component classes.
    pub labels: Vec<u16>,
    /// Shares of the component classes.
    pub confidence: Vec<f32>,
    /// Defect classes.
    pub defects: Vec<u16>,
    /// Shares of the defect classes.
    pub defect_confidence: Vec<f32>,
    /// Uncertainties of the component labels.
    pub sigma: Vec<f32>,
    /// Uncertainties of the defect labels.
    pub defect_sigma: Vec<f32>,
    /// Instances.
    pub instances: Vec<u16>,
    /// Numbers of views.
    pub views: Vec<u16>,
    /// Marks.
    pub flags: Vec<PointFlags>,
}

impl SemanticCloud {
    /// An empty cloud with room for `n` points.
    pub fn with_capacity(n: usize) -> Self {
        Self {
            positions: Vec::with_capacity(n),
            normals: Vec::with_capacity(n),
            colors: Vec::with_capacity(n),
            labels: Vec::with_capacity(n),
            confidence: Vec::with_capacity(n),
            defects: Vec::with_capacity(n),
            defect_confidence: Vec::with_capacity(n),
            sigma: Vec::with_capacity(n),
            defect_sigma: Vec::with_capacity(n),
            instances: Vec::with_capacity(n),
            views: Vec::with_capacity(n),
            flags: Vec::with_capacity(n),
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Appends a point.
    pub fn push(&mut self, p: SemanticPoint) {
        self.positions.push(p.position);
        self.normals.push(p.normal);
        self.colors.push(p.color);
        self.labels.push(p.label);
        self.confidence.push(p.confidence);
        self.defects.push(p.defect);
        self.defect_confidence.push(p.defect_confidence);
        self.sigma.push(p.sigma);
        self.defect_sigma.push(p.defect_sigma);
        self.instances.push(p.instance);
        self.views.push(p.views);
        self.flags.push(p.flags);
    }

    /// Point `i`, or `None` past the end.
    pub fn get(&self, i: usize) -> Option<SemanticPoint> {
        (i < self.len()).then(|| SemanticPoint {
            position: self.positions[i],
            normal: self.normals[i],
            color: self.colors[i],
            label: self.labels[i],
            confidence: self.confidence[i],
            defect: self.defects[i],
            defect_confidence: self.defect_confidence[i],
            sigma: self.sigma[i],
            defect_sigma: self.defect_sigma[i],
            instance: self.instances[i],
            views: self.views[i],
            flags: self.flags[i],
        })
    }

    /// Replaces point `i`; nothing happens past the end.
    pub fn set(&mut self, i: usize, p: SemanticPoint) {
        if i < self.len() {
            self.positions[i] = p.position;
            self.normals[i] = p.normal;
            self.colors[i] = p.color;
            self.labels[i] = p.label;
            self.confidence[i] = p.confidence;
            self.defects[i] = p.defect;
            self.defect_confidence[i] = p.defect_confidence;
            self.sigma[i] = p.sigma;
            self.defect_sigma[i] = p.defect_sigma;
            self.instances[i] = p.instance;
            self.views[i] = p.views;
            self.flags[i] = p.flags;
        }
    }

    /// All points in order.
    pub fn iter(&self) -> impl Iterator<Item = SemanticPoint> + '_ {
        (0..self.len()).filter_map(|i| self.get(i))
    }

    /// Appends every point of `other`.
    pub fn extend_from(&mut self, other: &Self) {
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.colors.extend_from_slice(&other.colors);
        self.labels.extend_from_slice(&other.labels);
        self.confidence.extend_from_slice(&other.confidence);
        self.defects.extend_from_slice(&other.defects);
        self.defect_confidence.extend_from_slice(&other.defect_confidence);
        self.sigma.extend_from_slice(&other.sigma);
        self.defect_sigma.extend_from_slice(&other.defect_sigma);
        self.instances.extend_from_slice(&other.instances);
        self.views.extend_from_slice(&other.views);
        self.flags.extend_from_slice(&other.flags);
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
