// Bending between two consecutive beams, without rotational degrees of freedom.

#define VIRIAL
#include "elements/beam2"

#if ROOT
fn force(bend: u32) {
    let stiffness = bends[BEND * bend];
    let rest = bends[BEND * bend + 1u];
    let first = vector(pairs[2u * bend]);
    let second = vector(pairs[2u * bend + 1u]);
    let current0 = first.reference + first.change;
    let current1 = second.reference + second.change;
    let inverse0 = 1.0 / norm(current0);
    let inverse1 = 1.0 / norm(current1);
    let tangent0 = current0 * inverse0;
    let tangent1 = current1 * inverse1;
    let cosine = dot(tangent0, tangent1);
    // a thread folded onto itself: tan(θ/2) is limited to 10
    let opening = max(1.0 + cosine, 0.02);
    let turned = cross(tangent0, tangent1);
    let smoothing = min(SMOOTHING, 0.5 * rest);
    let t = max(sqrt(dot(turned, turned) / (opening * opening) + smoothing * smoothing), 1e-12);
    let slope = -2.0 * stiffness * (1.0 - rest / t) / (opening * opening);
    let g0 = (tangent1 - tangent0 * cosine) * (slope * inverse0);
    let g1 = (tangent0 - tangent1 * cosine) * (slope * inverse1);
    let at = 6u * bend;
    forces[at] = g0.x;
    forces[at + 1u] = g0.y;
    forces[at + 2u] = g0.z;
    forces[at + 3u] = g1.x;
    forces[at + 4u] = g1.y;
    forces[at + 5u] = g1.z;
    energies[bend] = stiffness * (t - rest) * (t - rest);
#if PERIODIC
    add_virial(bend, g0, first.reference);
    add_virial(bend, g1, second.reference);
#endif
}
#endif
