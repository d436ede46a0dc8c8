// The schedule data of one time step. Units: mm, s. The rate of F̄ exists only in periodic scenes.

struct Row {
    gradient_xx: f32,
    gradient_xy: f32,
    gradient_xz: f32,
    gradient_yx: f32,
    gradient_yy: f32,
    gradient_yz: f32,
    gradient_zx: f32,
    gradient_zy: f32,
    gradient_zz: f32,
    rate_xx: f32,
    rate_xy: f32,
    rate_xz: f32,
    rate_yx: f32,
    rate_yy: f32,
    rate_yz: f32,
    rate_zx: f32,
    rate_zy: f32,
    rate_zz: f32,
    dt: f32,
    dt_mid: f32,
    thermal: f32,
    thermal_increment: f32,
    radius: f32,
    radius_increment: f32,
    damping_solid: f32,
    damping_thread: f32,
    motion: f32,
    amplitude: f32,
    cosine: f32,
    sine: f32,
    affine: f32,
    closing: f32,
    searched: f32,
    turn: f32,
}

@group(0) @binding(0) var<uniform> row: Row;

// F̄ − I; element [i] is row i.
fn gradient() -> array<vec3<f32>, 3> {
    return array<vec3<f32>, 3>(
        vec3<f32>(row.gradient_xx, row.gradient_xy, row.gradient_xz),
        vec3<f32>(row.gradient_yx, row.gradient_yy, row.gradient_yz),
        vec3<f32>(row.gradient_zx, row.gradient_zy, row.gradient_zz),
    );
}

#if PERIODIC
// The rate of F̄ over the last half step, 1/s; element [i] is row i.
fn rate() -> array<vec3<f32>, 3> {
    return array<vec3<f32>, 3>(
        vec3<f32>(row.rate_xx, row.rate_xy, row.rate_xz),
        vec3<f32>(row.rate_yx, row.rate_yy, row.rate_yz),
        vec3<f32>(row.rate_zx, row.rate_zy, row.rate_zz),
    );
}
#endif
