// Places and flags of the status buffer, which is bound as `status` wherever this is included by a kernel that raises it.

const FLAGS: u32 = 0u;
const TRAVEL: u32 = 1u;
const PENETRATION: u32 = 2u;
const CONTACT_RATE: u32 = 5u;
const TOUCHING: u32 = 6u;
const SPEED: u32 = 9u;
const CULPRIT: u32 = 10u;

const CELL_FULL: u32 = 1u;
const SLOTS_FULL: u32 = 2u;
const FORCE_RANGE: u32 = 4u;
const NOT_FINITE: u32 = 8u;

// Whether a number is neither infinite nor not a number; by its bits, since compilers may assume that it is.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

#if STATUS
// Raises a shared maximum of non-negative numbers, kept as the bits of an f32.
fn raise(place: u32, value: f32) {
    let bits = bitcast<u32>(value);
    if bits > atomicLoad(&status[place]) {
        atomicMax(&status[place], bits);
    }
}
#endif
