//! Where passes run: threads, SIMD level, memory.

use std::fmt;

use fearless_simd::Level;

use crate::api::shader::stages::{Execution, ShaderWidth};
use crate::geometry::chunk_output::ChunkOutput;
use crate::run::buffer_pool::BufferPool;
use crate::tile::walk::TileScratch;

/// Per thread: bytes of bins after which the tiles run, whatever the budget. Bins that leave the cache before they are read make
/// small primitives twice as dear.
const WAVE_BYTES: usize = 4 << 20;

/// Where passes run: threads, SIMD level, memory. Results do not depend on any of them.
pub struct Device {
    pub(crate) pool: rayon::ThreadPool,
    pub(crate) execution: Execution,
    bin_budget_bytes: usize,
    /// Buffers of earlier passes.
    pub(crate) chunks: BufferPool<ChunkOutput>,
    pub(crate) tiles: BufferPool<TileScratch>,
}

/// What was asked for; the buffers inside help nobody.
impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Device({} threads, {:?})", self.threads(), self.execution)
    }
}

/// How to make a [`Device`].
#[derive(Clone, Copy, Debug)]
pub struct DeviceOptions {
    /// Worker threads; `None` for one per core. Default: `None`.
    pub threads: Option<usize>,
    /// SIMD level; `None` for the machine's best. Default: `None`.
    pub level: Option<Level>,
    /// Lanes per shader call. Default: sixteen.
    pub width: ShaderWidth,
    /// Most bytes of bins before the tiles run. Default: 256 MiB.
    pub bin_budget_bytes: usize,
}

impl Default for DeviceOptions {
    fn default() -> Self {
        Self { threads: None, level: None, width: ShaderWidth::Sixteen, bin_budget_bytes: 256 << 20 }
    }
}

/// The worker threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start {threads} worker threads: {why}")]
pub struct DeviceError {
    /// Threads asked for; 0 means one per core.
    pub threads: usize,
    /// The system's reason.
    pub why: String,
}

impl Device {
    /// Starts the worker threads.
    pub fn new(options: DeviceOptions) -> Result<Self, DeviceError> {
        let threads = options.threads.unwrap_or(0);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| DeviceError { threads, why: error.to_string() })?;
        let level = options.level.unwrap_or_else(Level::new);
        Ok(Self {
            pool,
            execution: Execution { level, width: options.width },
            bin_budget_bytes: options.bin_budget_bytes,
            chunks: BufferPool::default(),
            tiles: BufferPool::default(),
        })
    }

    /// How shaders run.
    #[must_use]
    pub fn execution(&self) -> Execution {
        self.execution
    }

    /// Worker threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Bytes that bins may take before a wave is flushed: a few MiB per thread, or less if the budget is less.
    #[must_use]
    pub fn wave_bytes(&self) -> usize {
        self.bin_budget_bytes.min(WAVE_BYTES * self.threads())
    }

    /// Runs other data-parallel work on the device's threads.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }
}
