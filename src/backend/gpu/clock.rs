//! The device's own clock: timestamps around the dispatches of a few calls, from which the time of all calls is extrapolated.

/// Calls of a list of stages between two that are timed.
const TIMED_EVERY: u64 = 7;
/// Dispatches of a timed call at most.
const TIMED: u32 = 64;

/// Timestamps of one timed call.
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    pub resolved: wgpu::Buffer,
    /// Dispatches with a timestamp before and after, not yet read.
    waiting: Vec<String>,
}

/// Time of a dispatch.
pub(super) struct Time {
    pub name: String,
    calls: u64,
    runs: u64,
    timed: u64,
    timed_s: f64,
}

impl Clock {
    pub fn new(gpu: &wgpu::Device) -> Self {
        let count = 2 * TIMED;
        Self {
            queries: gpu.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("dispatches"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times of dispatches"),
                size: 8 * u64::from(count),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            waiting: Vec::new(),
        }
    }

    /// Whether a call with this number of dispatches can be timed: the timestamps before it have been read.
    pub fn takes(&self, dispatches: usize) -> bool {
        self.waiting.is_empty() && dispatches <= TIMED as usize
    }

    /// The timestamps before and after a dispatch.
    pub fn around(&self, number: usize) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * number as u32),
            end_of_pass_write_index: Some(2 * number as u32 + 1),
        }
    }

    /// Ends a timed call of some dispatches.
    pub fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder, names: impl Iterator<Item = String>) {
        self.waiting.extend(names);
        encoder.resolve_query_set(&self.queries, 0..2 * self.waiting.len() as u32, &self.resolved, 0);
    }

    /// Whether there are timestamps to read.
    pub fn waits(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Adds the timestamps that were read, in units of `period` (s), to the times of their dispatches.
    pub fn read(&mut self, bytes: &[u8], period: f64, times: &mut [Time]) {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
        for (name, ticks) in self.waiting.drain(..).zip(ticks.chunks_exact(2)) {
            if let Some(time) = times.iter_mut().find(|time| time.name == name) {
                time.timed += 1;
                time.timed_s += ticks[1].saturating_sub(ticks[0]) as f64 * period;
            }
        }
    }
}

impl Time {
    pub fn new(name: String) -> Self {
        Self { name, calls: 0, runs: 0, timed: 0, timed_s: 0.0 }
    }

    /// Counts a call that runs the dispatch some times; returns whether it should be timed.
    pub fn is_due(&mut self, runs: u64) -> bool {
        let due = self.calls.is_multiple_of(TIMED_EVERY);
        self.calls += 1;
        self.runs += runs;
        due
    }

    /// Name and time of all runs, s.
    pub fn whole(&self) -> (String, f64) {
        (self.name.clone(), self.timed_s / self.timed.max(1) as f64 * self.runs as f64)
    }
}
