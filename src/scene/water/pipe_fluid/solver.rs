//! The state of the fluid and its time step.

use fearless_simd::Level;
use glam::DVec2;
use rayon::prelude::*;

use super::super::{GRAVITY_M_PER_S2, Water};
use super::forces::{ActiveDrop, MovingObject, Rain};
use super::rows::{self, Moved, RowFlows, out};
use super::settings::{FluidSettings, InitialState};
use super::spray::Spray;

/// Latest time any fluid is simulated to, in seconds.
const MAX_TIME_S: f64 = 3600.0;
/// Longest step in seconds: half a frame, so that the straight lines between steps do not show as flicker of the shortest waves.
const MAX_STEP_S: f64 = 1.0 / 120.0;
/// Most steps any fluid is simulated for.
const MAX_STEPS: f64 = 4e6;
/// Cells that one task works on, about: some ten microseconds, and more than a small fluid has.
const CELLS_PER_TASK: usize = 4096;

/// A pipe-model fluid in motion.
///
/// A function of its settings and the time: [`advance`](Self::advance) and [`advance_to`](Self::advance_to) in any portions give the same bits.
#[derive(Clone, Debug)]
pub struct PipeFluid {
    pub(super) grid: Grid,
    level_m: f64,
    depth_m: f64,
    /// What a flow keeps over one step.
    damping: f64,
    step_s: f64,
    max_time_s: f64,
    initial: InitialState,
    drops: Vec<ActiveDrop>,
    rain: Option<Rain>,
    objects: Vec<MovingObject>,

    /// Time asked for, in seconds; the state is that of the first step not before it.
    time_s: f64,
    step_count: u64,
    /// Volume of every column after `step_count` steps, in m³; a rim of unused cells surrounds the grid.
    volumes: Vec<f64>,
    /// The same one step earlier.
    previous: Vec<f64>,
    /// Room for the volumes of the next step.
    next: Vec<f64>,
    flows: Flows,
    /// Head of every column, in metres; between steps that of its volume alone.
    heads: Vec<f64>,
    /// What of a column's outflow it can afford, `0..=1`.
    shares: Vec<f64>,
    /// Net flow into every column, in m³/s.
    inflows: Vec<f64>,
    initial_volume_m3: f64,
    added_volume_m3: f64,
    spray: Option<Spray>,
}

/// Cells of the fluid in the plane, with a rim one cell wide around them so that every cell has eight neighbours in memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub columns: usize,
    pub rows: usize,
    /// World (x, z) of the corner of the first cell.
    pub min_ws: DVec2,
    pub cell_m: DVec2,
}

/// Flow through every pipe in m³/s, stored at a cell `(i, j)` and positive from the first end to the second; zero where a pipe would lead into the rim.
#[derive(Clone, Debug)]
struct Flows {
    /// From `(i, j)` to `(i+1, j)`.
    east: Vec<f64>,
    /// From `(i, j)` to `(i, j+1)`.
    south: Vec<f64>,
    /// From `(i, j)` to `(i+1, j+1)`.
    south_east: Vec<f64>,
    /// The other diagonal of the same square, from `(i+1, j)` to `(i, j+1)`.
    south_west: Vec<f64>,
}

impl Flows {
    fn none(grid: &Grid) -> Self {
        let zeros = || vec![0.0; grid.len()];
        Self { east: zeros(), south: zeros(), south_east: zeros(), south_west: zeros() }
    }
}

impl Grid {
    fn new(settings: &FluidSettings, water: &Water) -> Self {
        let (columns, rows) = settings.cell_counts(water);
        let cell_m = water.size_m.as_dvec2() / DVec2::new(f64::from(columns), f64::from(rows));
        Self { columns: columns as usize, rows: rows as usize, min_ws: water.min_ws().as_dvec2(), cell_m }
    }

    /// Distance in memory between rows.
    pub fn stride(&self) -> usize {
        self.columns + 2
    }

    /// Index of a cell.
    pub fn index(&self, column: usize, row: usize) -> usize {
        (row + 1) * self.stride() + column + 1
    }

    fn len(&self) -> usize {
        self.stride() * (self.rows + 2)
    }

    /// Places in memory that one task works on: whole rows.
    fn task_len(&self) -> usize {
        (CELLS_PER_TASK / self.stride()).max(1) * self.stride()
    }

    /// The rows among `len` places from a task's first one: for each its number and the place of its first cell, counted from there.
    fn task_rows(self, task: usize, len: usize) -> impl Iterator<Item = (usize, usize)> {
        let first = task * self.task_len() / self.stride();
        // The rim is a row at either end.
        (0..len / self.stride())
            .map(move |k| (first + k, k))
            .filter(move |&(line, _)| (1..=self.rows).contains(&line))
            .map(move |(line, k)| (line - 1, k * self.stride() + 1))
    }

    pub fn cell_area_m2(&self) -> f64 {
        self.cell_m.x * self.cell_m.y
    }

    /// World (x, z) of the middle of a cell.
    pub fn center_ws(&self, column: usize, row: usize) -> DVec2 {
        self.min_ws + self.cell_m * DVec2::new(column as f64 + 0.5, row as f64 + 0.5)
    }

    /// The cell that holds a world (x, z), or the nearest.
    pub fn cell_at(&self, p_ws: DVec2) -> (usize, usize) {
        let cell = (p_ws - self.min_ws) / self.cell_m;
        // A cast saturates: negative and not-a-number become zero.
        ((cell.x as usize).min(self.columns - 1), (cell.y as usize).min(self.rows - 1))
    }

    /// Calls `visit(index, distance)` for every cell whose middle is closer than `radius_m` to `p_ws`, row by row.
    fn for_each_within(&self, p_ws: DVec2, radius_m: f64, mut visit: impl FnMut(usize, f64)) {
        let (first_column, first_row) = self.cell_at(p_ws - radius_m);
        let (last_column, last_row) = self.cell_at(p_ws + radius_m);
        for row in first_row..=last_row {
            for column in first_column..=last_column {
                let distance = (self.center_ws(column, row) - p_ws).length();
                if distance < radius_m {
                    visit(self.index(column, row), distance);
                }
            }
        }
    }

    /// Weights `(w_x, w_z, w_diagonal)` of the isotropic nine-point Laplacian, in 1/m².
    fn laplacian(&self) -> (f64, f64, f64) {
        let (x, z) = (1.0 / (self.cell_m.x * self.cell_m.x), 1.0 / (self.cell_m.y * self.cell_m.y));
        let diagonal = (x + z) / 12.0;
        (x - 2.0 * diagonal, z - 2.0 * diagonal, diagonal)
    }

    /// Half the longest stable step, in seconds, for waves of `speed_m_per_s`; at most [`MAX_STEP_S`].
    fn step_s(&self, speed_m_per_s: f64) -> f64 {
        // The eigenvalue is linear in cos(k_x Δx) and in cos(k_z Δz), so its maximum is at a corner.
        let (x, z, diagonal) = self.laplacian();
        let largest = (4.0 * x + 8.0 * diagonal).max(4.0 * z + 8.0 * diagonal).max(4.0 * (x + z));
        MAX_STEP_S.min(1.0 / (speed_m_per_s * largest.sqrt()))
    }
}

/// Weight of a soft round spot at distance `d` from its middle: `(1 − d²/R²)²`.
fn bump(d: f64, radius_m: f64) -> f64 {
    let x = 1.0 - (d / radius_m) * (d / radius_m);
    x * x
}

impl PipeFluid {
    /// The fluid at time 0 over the extent of `water`.
    #[must_use]
    pub fn new(settings: &FluidSettings, water: &Water) -> Self {
        let grid = Grid::new(settings, water);
        let depth_m = f64::from(settings.depth_m);
        let step_s = grid.step_s((GRAVITY_M_PER_S2 * depth_m).sqrt());
        let zeros = || vec![0.0; grid.len()];
        let mut fluid = Self {
            grid,
            level_m: f64::from(water.level_m),
            depth_m,
            damping: libm::exp(-f64::from(settings.damping_per_s) * step_s),
            step_s,
            max_time_s: MAX_TIME_S.min(MAX_STEPS * step_s),
            initial: settings.initial,
            drops: settings.drops.iter().map(ActiveDrop::from).collect(),
            rain: settings.rain,
            objects: settings.objects.clone(),
            time_s: 0.0,
            step_count: 0,
            volumes: zeros(),
            previous: zeros(),
            next: zeros(),
            flows: Flows::none(&grid),
            heads: zeros(),
            shares: zeros(),
            inflows: zeros(),
            initial_volume_m3: 0.0,
            added_volume_m3: 0.0,
            spray: settings.spray.map(Spray::new),
        };
        fluid.restart();
        fluid
    }

    /// Latest time a fluid with these settings can reach, in seconds.
    #[must_use]
    pub fn max_time_s(settings: &FluidSettings, water: &Water) -> f64 {
        let speed = (GRAVITY_M_PER_S2 * f64::from(settings.depth_m)).sqrt();
        MAX_TIME_S.min(MAX_STEPS * Grid::new(settings, water).step_s(speed))
    }

    /// Back to time 0.
    pub fn restart(&mut self) {
        self.time_s = 0.0;
        self.step_count = 0;
        self.added_volume_m3 = 0.0;
        self.flows = Flows::none(&self.grid);
        self.inflows.fill(0.0);
        if let Some(spray) = &mut self.spray {
            spray.restart();
        }
        for row in 0..self.grid.rows {
            for column in 0..self.grid.columns {
                let height = self.initial_height(column, row);
                self.volumes[self.grid.index(column, row)] = (self.depth_m + height) * self.grid.cell_area_m2();
            }
        }
        self.previous.copy_from_slice(&self.volumes);
        self.take_heads();
        self.initial_volume_m3 = self.columns_volume_m3();
    }

    fn initial_height(&self, column: usize, row: usize) -> f64 {
        match self.initial {
            InitialState::Still => 0.0,
            InitialState::Cosine { half_waves, amplitude_m } => {
                let along = |count: u32, index: usize, cells: usize| {
                    libm::cos(std::f64::consts::PI * f64::from(count) * (index as f64 + 0.5) / cells as f64)
                };
                f64::from(amplitude_m) * along(half_waves.0, column, self.grid.columns) * along(half_waves.1, row, self.grid.rows)
            }
            InitialState::Hump { center_m, radius_m, height_m } => {
                let (d, radius) = ((self.grid.center_ws(column, row) - center_m.as_dvec2()).length(), f64::from(radius_m));
                if d < radius { f64::from(height_m) * bump(d, radius) } else { 0.0 }
            }
        }
    }

    /// Moves on by `dt_s` seconds; negative goes back, which restarts the fluid.
    pub fn advance(&mut self, dt_s: f64) {
        self.advance_to(self.time_s + dt_s);
    }

    /// Moves to a time in seconds, brought into `0..=max_time_s` (not a number becomes 0). Costs the steps between; going back starts over.
    pub fn advance_to(&mut self, time_s: f64) {
        let time_s = time_s.max(0.0).min(self.max_time_s);
        let target = (time_s / self.step_s).ceil() as u64;
        if target < self.step_count {
            self.restart();
        }
        while self.step_count < target {
            if self.step_count + 1 == target {
                self.previous.copy_from_slice(&self.volumes);
            }
            self.step();
        }
        self.time_s = time_s;
    }

    /// Time the surface stands for, in seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Length of one step, in seconds.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Number of steps made since time 0.
    #[must_use]
    pub fn step_count(&self) -> u64 {
        self.step_count
    }

    /// Volume of all water after the last step, in the columns and in the air, in m³.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        self.columns_volume_m3() + self.spray.as_ref().map_or(0.0, Spray::volume_m3)
    }

    /// Volume the fluid started with, in m³.
    #[must_use]
    pub fn initial_volume_m3(&self) -> f64 {
        self.initial_volume_m3
    }

    /// Volume that drops have added since time 0, in m³.
    #[must_use]
    pub fn added_volume_m3(&self) -> f64 {
        self.added_volume_m3
    }

    /// Water in the air after the last step.
    #[must_use]
    pub fn spray(&self) -> &[super::SprayParticle] {
        self.spray.as_ref().map_or(&[], |spray| spray.particles())
    }

    /// Heights of the columns above the still level at [`Self::time_s`], in metres: `columns × rows`, columns (x) fastest.
    #[must_use]
    pub fn cell_heights_m(&self) -> Vec<f64> {
        // The two states straddle the time asked for; at time 0 they are the same one.
        let late = if self.step_count == 0 { 0.0 } else { self.time_s / self.step_s - (self.step_count - 1) as f64 };
        let scale = 1.0 / self.grid.cell_area_m2();
        let rows = (0..self.grid.rows).map(|row| self.grid.index(0, row));
        rows.flat_map(|start| start..start + self.grid.columns)
            .map(|i| (self.previous[i] + (self.volumes[i] - self.previous[i]) * late) * scale - self.depth_m)
            .collect()
    }

    pub(super) fn level_m(&self) -> f64 {
        self.level_m
    }

    /// Sum over rows of the sums of their columns.
    fn columns_volume_m3(&self) -> f64 {
        let row_sum = |row: usize| self.volumes[self.grid.index(0, row)..][..self.grid.columns].iter().sum::<f64>();
        (0..self.grid.rows).map(row_sum).sum()
    }

    /// One step of [`Self::step_s`].
    fn step(&mut self) {
        let start_s = self.step_count as f64 * self.step_s;
        let end_s = (self.step_count + 1) as f64 * self.step_s;
        self.press_objects(end_s);
        self.take_drops(start_s, end_s);
        self.accelerate();
        if self.move_volumes() {
            self.limit_outflows();
            self.move_volumes();
        }
        std::mem::swap(&mut self.volumes, &mut self.next);
        if let Some(spray) = &mut self.spray {
            spray.step(&self.grid, self.step_s, self.depth_m, &self.inflows, &mut self.volumes);
            self.take_heads();
        }
        self.step_count += 1;
    }

    /// Sets the heads to those of the volumes.
    fn take_heads(&mut self) {
        let scale = 1.0 / self.grid.cell_area_m2();
        for (head, volume) in self.heads.iter_mut().zip(&self.volumes) {
            *head = volume * scale;
        }
    }

    /// Raises the heads below bodies.
    fn press_objects(&mut self, time_s: f64) {
        let blur = self.grid.cell_m.x.max(self.grid.cell_m.y);
        for object in &self.objects {
            let draft = object.draft_at(time_s);
            let heads = &mut self.heads;
            self.grid.for_each_within(object.path.at(time_s), f64::from(object.radius_m) + blur, |i, r| {
                heads[i] += object.underside(r, draft, blur);
            });
        }
    }

    /// Adds the volume of drops and raises the heads below them.
    fn take_drops(&mut self, start_s: f64, end_s: f64) {
        let (grid, volumes, heads) = (&self.grid, &mut self.volumes, &mut self.heads);
        let mut added = 0.0;
        let mut take = |drop: &ActiveDrop| {
            let share = drop.share(start_s, end_s);
            if share <= 0.0 {
                return;
            }
            // The spot is normalised by its own sum over cells, so that volume and momentum are exact wherever it falls.
            let radius = (2.0 * drop.radius_m).max(1.5 * grid.cell_m.x.max(grid.cell_m.y));
            let mut total = 0.0;
            grid.for_each_within(drop.position_ws, radius, |_, d| total += bump(d, radius));
            if total <= 0.0 {
                return;
            }
            let volume = drop.volume_m3 * share;
            // A share of the impulse over this step, as a head: thrust · duration · share / (area · step).
            let head = drop.thrust_m3 * drop.duration_s * share / (grid.cell_area_m2() * (end_s - start_s));
            grid.for_each_within(drop.position_ws, radius, |i, d| {
                let weight = bump(d, radius) / total;
                volumes[i] += volume * weight;
                heads[i] += head * weight;
            });
            added += volume;
        };
        self.drops.iter().for_each(&mut take);
        if let Some(rain) = &self.rain {
            let size_m = grid.cell_m * DVec2::new(grid.columns as f64, grid.rows as f64);
            rain.for_each_active(start_s, end_s, grid.min_ws, size_m, take);
        }
        self.added_volume_m3 += added;
    }

    /// `Q ← damping · Q + Δt · g · (c/l) · (H_i − H_n)` for every pipe.
    fn accelerate(&mut self) {
        let grid = self.grid;
        let (columns, rows, stride) = (grid.columns, grid.rows, grid.stride());
        let (w_x, w_z, w_diagonal) = grid.laplacian();
        let scale = GRAVITY_M_PER_S2 * self.depth_m * grid.cell_area_m2() * self.step_s;
        let (damping, level) = (self.damping, Level::new());
        let heads = &self.heads;
        // Flows of pipes whose first ends start at the cell `from`, and whose other ends start at `to`.
        let update = |flows: &mut [f64], from: usize, to: usize, gain: f64| {
            let count = flows.len();
            rows::accelerate(level, flows, &heads[from..][..count], &heads[to..][..count], damping, gain);
        };
        // A wall mirrors the water: a diagonal pipe into the mirror image is one more along the wall.
        let (gain_x, gain_z, gain_diagonal) = (scale * w_x, scale * w_z, scale * w_diagonal);
        let len = grid.task_len();
        let Flows { east, south, south_east, south_west } = &mut self.flows;
        let tasks = (east.par_chunks_mut(len), south.par_chunks_mut(len), south_east.par_chunks_mut(len), south_west.par_chunks_mut(len));
        tasks.into_par_iter().enumerate().for_each(|(task, (east, south, south_east, south_west))| {
            for (row, own) in grid.task_rows(task, east.len()) {
                let i = grid.index(0, row);
                let below = i + stride;
                let walls = usize::from(row == 0) + usize::from(row + 1 == rows);
                update(&mut east[own..][..columns - 1], i, i + 1, gain_x + gain_diagonal * walls as f64);
                if row + 1 < rows {
                    let south = &mut south[own..][..columns];
                    update(&mut south[..1], i, below, gain_z + gain_diagonal);
                    update(&mut south[1..columns - 1], i + 1, below + 1, gain_z);
                    update(&mut south[columns - 1..], i + columns - 1, below + columns - 1, gain_z + gain_diagonal);
                    update(&mut south_east[own..][..columns - 1], i, below + 1, gain_diagonal);
                    update(&mut south_west[own..][..columns - 1], i + 1, below, gain_diagonal);
                }
            }
        });
    }

    /// Scales what leaves a column that does not hold enough for the whole step, as O'Brien & Hodgins do.
    fn limit_outflows(&mut self) {
        let stride = self.grid.stride();
        let Flows { east, south, south_east, south_west } = &self.flows;
        for row in 0..self.grid.rows {
            let start = self.grid.index(0, row);
            for i in start..start + self.grid.columns {
                let total = out(east[i])
                    + out(-east[i - 1])
                    + out(south[i])
                    + out(-south[i - stride])
                    + (out(south_east[i]) + out(-south_east[i - stride - 1]))
                    + (out(south_west[i - 1]) + out(-south_west[i - stride]));
                let wanted = total * self.step_s;
                let share = if wanted > self.volumes[i] { (self.volumes[i] / wanted).max(0.0) } else { 1.0 };
                self.shares[i] = share;
            }
        }
        let shares = &self.shares;
        let Flows { east, south, south_east, south_west } = &mut self.flows;
        let limit = |flow: &mut f64, from: usize, to: usize| *flow *= if *flow > 0.0 { shares[from] } else { shares[to] };
        for row in 0..self.grid.rows {
            let start = self.grid.index(0, row);
            for i in start..start + self.grid.columns {
                limit(&mut east[i], i, i + 1);
                limit(&mut south[i], i, i + stride);
                limit(&mut south_east[i], i, i + stride + 1);
                limit(&mut south_west[i], i + 1, i + stride);
            }
        }
    }

    /// `V ← V + Δt · (sum of flows in)`, to [`Self::next`], and the heads of the new volumes; whether any column does not hold what leaves it.
    fn move_volumes(&mut self) -> bool {
        let grid = self.grid;
        let (stride, columns, step_s, level) = (grid.stride(), grid.columns, self.step_s, Level::new());
        let scale = 1.0 / grid.cell_area_m2();
        let Flows { east, south, south_east, south_west } = &self.flows;
        let volumes = &self.volumes;
        let len = grid.task_len();
        let tasks = (self.next.par_chunks_mut(len), self.inflows.par_chunks_mut(len), self.heads.par_chunks_mut(len));
        let move_row = |row: usize, moved: Moved<'_>| {
            let i = grid.index(0, row);
            let flows = RowFlows {
                east: [&east[i..][..columns], &east[i - 1..][..columns]],
                south: [&south[i..][..columns], &south[i - stride..][..columns]],
                south_east: [&south_east[i..][..columns], &south_east[i - stride - 1..][..columns]],
                south_west: [&south_west[i - 1..][..columns], &south_west[i - stride..][..columns]],
            };
            rows::move_volumes(level, flows, &volumes[i..][..columns], step_s, scale, moved)
        };
        let dry = tasks.into_par_iter().enumerate().map(|(task, (next, inflows, heads))| {
            let mut dry = false;
            for (row, own) in grid.task_rows(task, next.len()) {
                let own = own..own + columns;
                let moved = Moved { volumes: &mut next[own.clone()], inflows: &mut inflows[own.clone()], heads: &mut heads[own] };
                dry |= move_row(row, moved);
            }
            dry
        });
        dry.reduce(|| false, |a, b| a || b)
    }
}
