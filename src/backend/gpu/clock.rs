//! The device's own clock: timestamps around the stages of a few calls, from which the time of all calls is extrapolated.

/// Calls of a list of stages between two that are timed.
const TIMED_EVERY: u64 = 7;
/// Stages of a timed call at most.
const TIMED_STAGES: u32 = 64;

/// Timestamps of one timed call.
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    pub resolved: wgpu::Buffer,
    /// Stages with a timestamp before and after, not yet read.
    waiting: Vec<&'static str>,
}

/// Time of a stage.
pub(super) struct Time {
    pub stage: &'static str,
    calls: u64,
    runs: u64,
    timed: u64,
    timed_s: f64,
}

impl Clock {
    pub fn new(gpu: &wgpu::Device) -> Self {
        let count = 2 * TIMED_STAGES;
        Self {
            queries: gpu.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stages"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times of stages"),
                size: 8 * u64::from(count),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            waiting: Vec::new(),
        }
    }

    /// Whether a call with this number of stages can be timed: the timestamps before it have been read.
    pub fn takes(&self, stages: usize) -> bool {
        self.waiting.is_empty() && stages <= TIMED_STAGES as usize
    }

    /// The timestamps before and after a stage.
    pub fn around(&self, number: usize) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * number as u32),
            end_of_pass_write_index: Some(2 * number as u32 + 1),
        }
    }

    /// Ends a timed call of some stages.
    pub fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder, stages: impl Iterator<Item = &'static str>) {
        self.waiting.extend(stages);
        encoder.resolve_query_set(&self.queries, 0..2 * self.waiting.len() as u32, &self.resolved, 0);
    }

    /// Whether there are timestamps to read.
    pub fn waits(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Adds the timestamps that were read, in units of `period` (s), to the times of their stages.
    pub fn read(&mut self, bytes: &[u8], period: f64, times: &mut [Time]) {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
        for (stage, ticks) in self.waiting.drain(..).zip(ticks.chunks_exact(2)) {
            if let Some(time) = times.iter_mut().find(|time| time.stage == stage) {
                time.timed += 1;
                time.timed_s += ticks[1].saturating_sub(ticks[0]) as f64 * period;
            }
        }
    }
}

impl Time {
    pub fn new(stage: &'static str) -> Self {
        Self { stage, calls: 0, runs: 0, timed: 0, timed_s: 0.0 }
    }

    /// Counts a call that runs the stage some times; returns whether it should be timed.
    pub fn is_due(&mut self, runs: u64) -> bool {
        let due = self.calls.is_multiple_of(TIMED_EVERY);
        self.calls += 1;
        self.runs += runs;
        due
    }

    /// Name and time of all runs, s.
    pub fn whole(&self) -> (&'static str, f64) {
        (self.stage, self.timed_s / self.timed.max(1) as f64 * self.runs as f64)
    }
}
