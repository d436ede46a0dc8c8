// How far contact points have slipped since the start.

#if PERIODIC
const SUMS: u32 = 14u;
#else
const SUMS: u32 = 5u;
#endif
const SUM_SLIP: u32 = 4u;

#if ROOT
@group(1) @binding(0) var<storage, read> sums: array<f32>;
@group(1) @binding(1) var<storage, read_write> slipped: array<f32>;

fn slip(item: u32) {
    slipped[item] = slipped[item] + sums[SUMS * item + SUM_SLIP];
}
#endif
