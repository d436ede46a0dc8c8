// Elementary functions as polynomials, to the terms that f32 needs.

// Mantissa from √½ to √2, and exponent, of a positive normal number.
fn mantissa_exponent(x: f32) -> vec2<f32> {
    let bits = bitcast<u32>(x);
    let biased = (bits - SQRT_HALF + BIAS) >> 23u;
    return vec2<f32>(bitcast<f32>(bits - (biased << 23u) + BIAS), f32(biased) - 127.0);
}

// Natural logarithm of a positive normal number.
fn ln(x: f32) -> f32 {
    let split = mantissa_exponent(x);
    return logarithm(split.x - 1.0, split.y);
}

// ln(1 + x) for x > −1.
fn log1p(x: f32) -> f32 {
    let split = mantissa_exponent(1.0 + x);
    return logarithm(select(split.x - 1.0, x, abs(split.y) < 0.5), split.y);
}

// ln(1 + f) + e ln 2.
fn logarithm(f: f32, e: f32) -> f32 {
    let s = f / (f + 2.0);
    let z = s * s;
    var p = 1.0 / 11.0;
    p = fma(p, z, 1.0 / 9.0);
    p = fma(p, z, 1.0 / 7.0);
    p = fma(p, z, 1.0 / 5.0);
    p = fma(p, z, 1.0 / 3.0);
    p = fma(p, z, 1.0);
    return fma(e, LN2_HIGH, fma(s + s, p, e * LN2_LOW));
}

// e^x for |x| below 80.
fn exp(x: f32) -> f32 {
    let n = round(x * LOG2_E);
    let r = fma(n, -LN2_LOW, fma(n, -LN2_HIGH, x));
    var p = 1.0 / 40320.0;
    p = fma(p, r, 1.0 / 5040.0);
    p = fma(p, r, 1.0 / 720.0);
    p = fma(p, r, 1.0 / 120.0);
    p = fma(p, r, 1.0 / 24.0);
    p = fma(p, r, 1.0 / 6.0);
    p = fma(p, r, 0.5);
    p = fma(p, r, 1.0);
    p = fma(p, r, 1.0);
    return p * bitcast<f32>(u32(i32(n) + 127) << 23u);
}

// asinh(√u)/√u for u ≥ 0.
fn asinh_ratio(u: f32) -> f32 {
    var series = 35.0 / 1152.0;
    series = fma(series, u, -5.0 / 112.0);
    series = fma(series, u, 3.0 / 40.0);
    series = fma(series, u, -1.0 / 6.0);
    series = fma(series, u, 1.0);
    let s = sqrt(max(u, 1e-30));
    let q = sqrt(1.0 + u);
    let far = log1p(s + u / (1.0 + q)) / s;
    return select(far, series, u < 0.01);
}
