// Positions as whole quanta plus a remainder.

// Nearest whole number; beyond 4e6 towards zero, as on the CPU.
fn to_i32(x: f32) -> i32 {
    if abs(x) < 4e6 {
        return i32(round(x));
    }
    return i32(x);
}

// Moves whole quanta from the remainder into the integer part; returns it, and changes the remainder.
fn carry(quanta: i32, remainder: ptr<function, f32>) -> i32 {
    let whole = to_i32(*remainder * QUANTA_PER_MM);
    *remainder = *remainder - f32(whole) * QUANTUM;
    return quanta + whole;
}

// A displacement, mm.
fn in_mm(quanta: i32, remainder: f32) -> f32 {
    return f32(quanta) * QUANTUM + remainder;
}

// Difference of two positions, mm.
fn difference(quanta: i32, remainder: f32, from_quanta: i32, from_remainder: f32) -> f32 {
    return f32(quanta - from_quanta) * QUANTUM + (remainder - from_remainder);
}
