//! Counters of a pass. All are exact and independent of threads and SIMD level.

/// Pipeline statistics of a pass.
///
/// The first six are the counters of WebGPU's and Vulkan's pipeline-statistics queries; the others tell why primitives or fragments are not visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PipelineStatistics {
    /// Vertices shaded. Repeated indices within a chunk are shaded once.
    pub vertex_shader_invocations: u64,
    /// Primitives that entered the geometry stage.
    pub geometry_shader_invocations: u64,
    /// Primitives that the geometry stage emitted.
    pub geometry_shader_primitives: u64,
    /// Primitives that reached clipping.
    pub clipper_invocations: u64,
    /// Primitives that left clipping.
    pub clipper_primitives_out: u64,
    /// Fragments shaded, without helper lanes. For a primitive of one colour all its fragments are counted.
    pub fragment_shader_invocations: u64,
    /// Primitives outside the view, or with a coordinate that is NaN or infinite.
    pub primitives_rejected: u64,
    /// Triangles culled by facing.
    pub primitives_culled: u64,
    /// Triangles without area after snapping.
    pub primitives_zero_area: u64,
    /// Primitives that cover no pixel centre inside the scissor.
    pub primitives_without_samples: u64,
    /// Fragments that passed depth, stencil and discard.
    pub fragments_passed: u64,
}

impl PipelineStatistics {
    /// Name and value of every counter.
    #[must_use]
    pub fn named(&self) -> [(&'static str, u64); 11] {
        [
            ("vertex_shader_invocations", self.vertex_shader_invocations),
            ("geometry_shader_invocations", self.geometry_shader_invocations),
            ("geometry_shader_primitives", self.geometry_shader_primitives),
            ("clipper_invocations", self.clipper_invocations),
            ("clipper_primitives_out", self.clipper_primitives_out),
            ("fragment_shader_invocations", self.fragment_shader_invocations),
            ("primitives_rejected", self.primitives_rejected),
            ("primitives_culled", self.primitives_culled),
            ("primitives_zero_area", self.primitives_zero_area),
            ("primitives_without_samples", self.primitives_without_samples),
            ("fragments_passed", self.fragments_passed),
        ]
    }

    /// Adds the counters of another pass or worker.
    pub fn add(&mut self, other: &Self) {
        self.vertex_shader_invocations += other.vertex_shader_invocations;
        self.geometry_shader_invocations += other.geometry_shader_invocations;
        self.geometry_shader_primitives += other.geometry_shader_primitives;
        self.clipper_invocations += other.clipper_invocations;
        self.clipper_primitives_out += other.clipper_primitives_out;
        self.fragment_shader_invocations += other.fragment_shader_invocations;
        self.primitives_rejected += other.primitives_rejected;
        self.primitives_culled += other.primitives_culled;
        self.primitives_zero_area += other.primitives_zero_area;
        self.primitives_without_samples += other.primitives_without_samples;
        self.fragments_passed += other.fragments_passed;
    }
}

/// Counters of a draw with stream-out [D3D11.3 §14.5].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamOutStatistics {
    /// Primitives written. A primitive is written whole or not at all.
    pub primitives_written: u64,
    /// Primitives that a buffer of unlimited size would have received.
    pub primitive_storage_needed: u64,
}
