//! Devices: threads, SIMD level and memory of passes.

use std::fmt;

use fearless_simd::Level;

use crate::api::shader::stages::{Execution, ShaderWidth};
use crate::geometry::chunk_output::ChunkOutput;
use crate::run::buffer_pool::BufferPool;
use crate::tile::walk::TileScratch;

/// Bytes of bins per thread after which the tiles run, whatever the budget is. Bins that leave the cache before they are read double the cost of
/// small primitives.
const WAVE_BYTES: usize = 4 << 20;

/// Threads, SIMD level and memory that passes run with. Results do not depend on any of them.
pub struct Device {
    pub(crate) pool: rayon::ThreadPool,
    pub(crate) execution: Execution,
    bin_budget_bytes: usize,
    /// Buffers of earlier passes, for reuse.
    pub(crate) chunks: BufferPool<ChunkOutput>,
    pub(crate) tiles: BufferPool<TileScratch>,
}

/// Shows the options; the buffers are left out.
impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Device({} threads, {:?})", self.threads(), self.execution)
    }
}

/// Options of a [`Device`].
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

/// Stack of a worker thread. In a build without optimization (`opt-level = 0`), every vector of lanes has its own place on the stack and the tile
/// workers overflow the usual 2 MiB, and 4; 8 are enough. Only the pages that are touched are memory.
const STACK_BYTES: usize = 32 << 20;

impl Device {
    /// Starts the worker threads.
    ///
    /// # Errors
    /// If the system refuses to start them.
    pub fn new(options: DeviceOptions) -> Result<Self, DeviceError> {
        let threads = options.threads.unwrap_or(0);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .stack_size(STACK_BYTES)
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

    /// SIMD level and width of shader execution.
    #[must_use]
    pub fn execution(&self) -> Execution {
        self.execution
    }

    /// Number of worker threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Bytes of bins after which a wave is flushed: a few MiB per thread, or the budget if that is less.
    #[must_use]
    pub fn wave_bytes(&self) -> usize {
        self.bin_budget_bytes.min(WAVE_BYTES * self.threads())
    }

    /// Runs other data-parallel work on the device's threads.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }
}
