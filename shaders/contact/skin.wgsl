// Contact skin (Verlet skin): largest nodal speed, validity of positions and, with CONTACT, the distance travelled since the
// last candidate check.

#include "kernel/position"
#if travel
#define STATUS
#endif
#include "contact/mod"

#if ROOT
#if remember
fn remember(node: u32) {
    let plane = arrayLength(&remainder) / 3u;
    for (var k = 0u; k < 3u; k++) {
        search_quanta[node + k * plane] = quanta[node + k * plane];
        search_remainder[node + k * plane] = remainder[node + k * plane];
    }
}
#endif

#if travel
fn travel(node: u32) {
    let plane = arrayLength(&remainder) / 3u;
    var far = 0.0;
    var furthest = 0.0;
#if CONTACT
    var square = 0.0;
#endif
    for (var k = 0u; k < 3u; k++) {
        let i = node + k * plane;
#if CONTACT
        let d = difference(quanta[i], remainder[i], search_quanta[i], search_remainder[i]);
        square = square + d * d;
#endif
        let moved = in_mm(quanta[i], remainder[i]);
        far = far + moved * moved;
        furthest = max(furthest, abs(moved));
    }
    if !is_finite(far) {
        atomicOr(&status[FLAGS], NOT_FINITE);
    } else if furthest > MOST_MM {
        atomicOr(&status[FLAGS], OUT_OF_RANGE);
    }
    let v = vec3<f32>(velocity[node], velocity[node + plane], velocity[node + 2u * plane]);
#if CONTACT
    raise(TRAVEL, sqrt(square));
#endif
    raise(SPEED, sqrt(dot(v, v)));
}
#endif
#endif
