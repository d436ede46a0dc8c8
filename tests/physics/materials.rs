//! Every law against its energy, its symmetries and closed forms; the fibre law against values in high precision. A new law gets
//! a row in [`laws`] and inherits all tests that are not specific to one law.

use crate::common::{Random, below, near, norm};
use std::marker::PhantomData;
use tricot::kernel::lane::{Isa, Lane, Real, Work};
use tricot::materials::charmetant::{self, Charmetant};
use tricot::materials::neo_hookean::{self, NeoHookean};
use tricot::materials::{Material, PARAMETERS, Tensor};

type Parameters = [f64; PARAMETERS];

/// A law as the tests see it.
struct LawRow {
    name: &'static str,
    parameters: Parameters,
    isotropic: bool,
    stress: fn(&Parameters, &Tensor<f64>) -> Tensor<f64>,
    energy: fn(&Parameters, &Tensor<f64>) -> [f64; 4],
    /// Stress and energy (13 numbers) of many states on an instruction set, as bits.
    f32: fn(Isa, &Parameters, &[Tensor<f64>]) -> Vec<u64>,
    f64: fn(Isa, &Parameters, &[Tensor<f64>]) -> Vec<u64>,
}

fn row<M: Material>(name: &'static str, isotropic: bool, parameters: Parameters) -> LawRow {
    LawRow {
        name,
        parameters,
        isotropic,
        stress: M::stress::<f64>,
        energy: M::energy::<f64>,
        f32: |isa, p, h| bits::<M, f32>(isa, p, h),
        f64: |isa, p, h| bits::<M, f64>(isa, p, h),
    }
}

fn laws() -> Vec<LawRow> {
    vec![
        row::<Charmetant>("charmetant", false, px35(1e-3)),
        row::<Charmetant>("charmetant without cap", false, px35(0.0)),
        row::<NeoHookean>("neo-Hookean", true, neo_hookean::parameters(1000.0, 0.3)),
    ]
}

/// Values of Table 3 with a cap on the compaction power.
fn px35(cap: f64) -> Parameters {
    charmetant::parameters(108_500.0, 1.25, 1.84, 0.6, 2.2, cap)
}

fn bits<M: Material, R: Real>(isa: Isa, parameters: &Parameters, states: &[Tensor<f64>]) -> Vec<u64> {
    struct Batch<'a, M, R>(&'a Parameters, &'a [Tensor<f64>], &'a mut Vec<R>, PhantomData<M>);
    impl<M: Material, R: Real> Work<R> for Batch<'_, M, R> {
        const WIDE: bool = true;
        fn run<L: Lane<Scalar = R>>(self) {
            let parameters = self.0.map(L::new);
            for states in self.1.chunks_exact(L::WIDTH) {
                let gather = |i: usize, j: usize| {
                    let column: Vec<R> = states.iter().map(|h| R::from_f64(h[i][j])).collect();
                    L::load(&column)
                };
                let h: Tensor<L> = [0, 1, 2].map(|i| [0, 1, 2].map(|j| gather(i, j)));
                let all = M::stress(&parameters, &h).concat().into_iter().chain(M::energy(&parameters, &h));
                let mut columns = vec![];
                for value in all {
                    let mut column = vec![R::default(); L::WIDTH];
                    value.store(&mut column);
                    columns.push(column);
                }
                for lane in 0..L::WIDTH {
                    self.2.extend(columns.iter().map(|c| c[lane]));
                }
            }
        }
    }
    let mut out = vec![];
    R::dispatch(isa, Batch(parameters, states, &mut out, PhantomData::<M>));
    out.into_iter().map(|x| x.to_f64().to_bits()).collect()
}

fn multiply(a: &Tensor<f64>, b: &Tensor<f64>) -> Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transpose(a: &Tensor<f64>) -> Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[j][i]))
}

fn plus_identity(a: &Tensor<f64>, factor: f64) -> Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] + if i == j { factor } else { 0.0 }))
}

fn inverse(f: &Tensor<f64>) -> Tensor<f64> {
    let columns = [0, 1, 2].map(|k| [f[0][k], f[1][k], f[2][k]]);
    let rows = [(1, 2), (2, 0), (0, 1)].map(|(a, b)| crate::common::cross(columns[a], columns[b]));
    let det: f64 = (0..3).map(|k| columns[0][k] * rows[0][k]).sum();
    rows.map(|row| row.map(|x| x / det))
}

fn determinant(f: &Tensor<f64>) -> f64 {
    crate::common::cross(f[0], f[1]).iter().zip(f[2]).map(|(a, b)| a * b).sum()
}

/// Rotation by an angle about an axis.
fn rotation(axis: usize, angle: f64) -> Tensor<f64> {
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut q = [[0.0; 3]; 3];
    q[axis][axis] = 1.0;
    (q[a][a], q[b][b]) = (angle.cos(), angle.cos());
    (q[a][b], q[b][a]) = (-angle.sin(), angle.sin());
    q
}

/// Displacement gradients of a size, some of them compacted, some expanded.
fn states(size: f64, count: usize) -> Vec<Tensor<f64>> {
    let mut random = Random(1);
    (0..count).map(|_| [0, 1, 2].map(|_| [0, 1, 2].map(|_| size * random.draw()))).collect()
}

/// Norms of the part along the fibre and of the part in the cross-section.
fn parts(s: &Tensor<f64>) -> [f64; 2] {
    [norm(s[0]), norm([s[1][1], s[2][2], std::f64::consts::SQRT_2 * s[1][2]])]
}

fn difference(a: &Tensor<f64>, b: &Tensor<f64>) -> Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] - b[i][j]))
}

fn size(a: &Tensor<f64>) -> f64 {
    a.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

/// ¼ ln(I₃/I₄): the invariant of compaction.
fn section(h: &Tensor<f64>) -> f64 {
    let f = plus_identity(h, 1.0);
    0.5 * (determinant(&f) / norm([f[0][0], f[1][0], f[2][0]])).ln()
}

fn pk2(law: &LawRow, h: &Tensor<f64>) -> Tensor<f64> {
    multiply(&inverse(&plus_identity(h, 1.0)), &(law.stress)(&law.parameters, h))
}

/// Cauchy stress.
fn cauchy(law: &LawRow, f: &Tensor<f64>) -> Tensor<f64> {
    let p = (law.stress)(&law.parameters, &plus_identity(f, -1.0));
    let det = determinant(f);
    multiply(&p, &transpose(f)).map(|row| row.map(|x| x / det))
}

#[test]
fn the_fibre_law_meets_its_reference_values() {
    #[derive(serde::Deserialize)]
    struct Reference {
        name: String,
        #[serde(rename = "F")]
        f: [f64; 9],
        w: f64,
        #[serde(rename = "S")]
        s: [f64; 9],
    }
    let text = include_str!("../data/charmetant.json");
    let references: Vec<Reference> = serde_json::from_str(text).unwrap();
    assert_eq!(references.len(), 55);
    let law = row::<Charmetant>("charmetant", false, px35(0.0));
    let tensor = |a: &[f64; 9]| [[a[0], a[1], a[2]], [a[3], a[4], a[5]], [a[6], a[7], a[8]]];
    let mut worst = [(0.0, ""); 3];
    for r in &references {
        let h = plus_identity(&tensor(&r.f), -1.0);
        let (got, expected) = (pk2(&law, &h), tensor(&r.s));
        let apart = difference(&got, &expected);
        let (error, whole) = (parts(&apart), parts(&expected));
        let energy = (law.energy)(&law.parameters, &h).iter().sum::<f64>();
        let s11 = (apart[0][0].abs(), expected[0][0].abs());
        for (worst, (error, whole)) in
            worst.iter_mut().zip([s11, (error[1], whole[1]), ((energy - r.w).abs(), r.w.abs())])
        {
            // an unloaded cross-section may keep 1e-15 MPa
            let relative = (error - 1e-15).max(0.0) / whole.max(1e-300);
            if relative > worst.0 {
                *worst = (relative, &r.name);
            }
        }
    }
    for (what, (error, name)) in ["S11", "cross-section", "energy"].into_iter().zip(worst) {
        below(&format!("{what} against 55 reference states, worst at \"{name}\""), error, 1e-10);
    }
}

#[test]
fn the_fibre_law_meets_closed_forms() {
    let law = row::<Charmetant>("charmetant", false, px35(0.0));
    let identity = rotation(0, 0.0);
    let at = |changes: &[(usize, usize, f64)]| {
        let mut f = identity;
        for (i, j, x) in changes {
            f[*i][*j] = *x;
        }
        cauchy(&law, &f)
    };
    near("elongation 1.01, s11", at(&[(0, 0, 1.01)])[0][0], 108_500.0 * 1.01f64.ln() / 1.01, 1e-12);
    near("elongation 1.01, s11 as tabulated", at(&[(0, 0, 1.01)])[0][0], 1068.92, 5e-6);
    let squeezed = at(&[(1, 1, 0.9), (2, 2, 0.9)]);
    near("compaction 0.9, s22", squeezed[1][1], -0.214418, 5e-6);
    near("compaction 0.9, s33", squeezed[2][2], -0.214418, 5e-6);
    let flat = at(&[(1, 1, 0.8)]);
    near("transverse 0.8, s22", flat[1][1], -0.269639, 5e-6);
    near("transverse 0.8, s33", flat[2][2], -0.185960, 5e-6);
    near("longitudinal shear 0.3, s12", at(&[(0, 1, 0.3)])[0][1], 0.66, 1e-12);
    near("transverse shear 0.3, s23", at(&[(1, 2, 0.3)])[1][2], 0.0443369, 2e-6);
}

#[test]
fn small_strain_moduli() {
    let law = row::<Charmetant>("charmetant", false, px35(1e-3));
    let e = 1e-7;
    let with = |i: usize, j: usize| {
        let mut h = [[0.0; 3]; 3];
        h[i][j] = e;
        (law.stress)(&law.parameters, &h)
    };
    near("charmetant, along the fibre", with(0, 0)[0][0] / e, 108_500.0, 1e-6);
    near("charmetant, longitudinal shear", with(0, 1)[0][1] / e, 2.2, 1e-6);
    near("charmetant, transverse shear", with(1, 2)[1][2] / e, 0.15, 1e-6);
    let swollen = (law.stress)(&law.parameters, &[[0.0; 3], [0.0, e, 0.0], [0.0, 0.0, e]]);
    near("charmetant, transverse dilation", swollen[1][1] / e, 0.0, 1e-12);
    let law = row::<NeoHookean>("neo-Hookean", true, neo_hookean::parameters(1000.0, 0.3));
    let strained = |h: Tensor<f64>| (law.stress)(&law.parameters, &h);
    let (mu, lambda) = (1000.0 / 2.6, 300.0 / (1.3 * 0.4));
    let stretched = strained([[e, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
    near("neo-Hookean, uniaxial strain", stretched[0][0] / e, lambda + 2.0 * mu, 1e-6);
    near("neo-Hookean, lateral", stretched[1][1] / e, lambda, 1e-6);
    near("neo-Hookean, shear", strained([[0.0, e, 0.0], [0.0; 3], [0.0; 3]])[0][1] / e, mu, 1e-6);
}

#[test]
fn below_the_cap_the_compaction_power_is_a_parabola_that_fits_smoothly() {
    let cap = 1e-3;
    let capped = row::<Charmetant>("capped", false, px35(cap));
    let free = row::<Charmetant>("free", false, px35(0.0));
    // equibiaxial: I_comp = ln λ
    let squeezed = |i: f64| {
        let l = (-i).exp_m1();
        [[0.0; 3], [0.0, l, 0.0], [0.0, 0.0, l]]
    };
    let w = |law: &LawRow, i: f64| (law.energy)(&law.parameters, &squeezed(i))[1];
    let s = |law: &LawRow, i: f64| pk2(law, &squeezed(i))[1][1];
    let slope = 1.25 * 1.84 * f64::powf(cap, -0.16);
    for i in [1e-6, 1e-4, 5e-4] {
        near(&format!("energy at I_comp = -{i}"), w(&capped, i), 0.5 * slope * i * i, 1e-9);
        near(&format!("s22 at I_comp = -{i}"), s(&capped, i), -0.5 * slope * i * (4.0 * i).exp().sqrt(), 1e-9);
    }
    near("energy just above and below the cap", w(&capped, cap * (1.0 - 1e-9)), w(&capped, cap * (1.0 + 1e-9)), 1e-8);
    near("s22 just above and below the cap", s(&capped, cap * (1.0 - 1e-9)), s(&capped, cap * (1.0 + 1e-9)), 1e-8);
    near("s22 with and without cap at I_comp = -0.01", s(&capped, 0.01), s(&free, 0.01), 1e-12);
}

#[test]
fn stress_is_the_derivative_of_the_energy() {
    for law in laws() {
        let mut worst = [0.0f64; 2];
        for (scale, count) in [(0.02, 8), (0.1, 16), (0.3, 16)] {
            for h in states(scale, count) {
                // differences across I_comp = 0, where the power p < 2 has no second derivative, say nothing
                if section(&h).abs() < 0.01 * scale.sqrt() {
                    continue;
                }
                let w = |i: usize, j: usize, step: f64| {
                    let mut moved = h;
                    moved[i][j] += step;
                    (law.energy)(&law.parameters, &moved).iter().sum::<f64>()
                };
                let e = 1e-4 * scale.sqrt();
                let slope = |i: usize, j: usize| {
                    (8.0 * (w(i, j, e) - w(i, j, -e)) - (w(i, j, 2.0 * e) - w(i, j, -2.0 * e))) / (12.0 * e)
                };
                let f_inverse = inverse(&plus_identity(&h, 1.0));
                let by_energy = multiply(&f_inverse, &[0, 1, 2].map(|i| [0, 1, 2].map(|j| slope(i, j))));
                let s = pk2(&law, &h);
                let (error, whole) = (parts(&difference(&s, &by_energy)), parts(&s));
                for k in 0..2 {
                    worst[k] = worst[k].max(error[k] / whole[k]);
                }
            }
        }
        below(&format!("{}: stress against differences of the energy, fibre part", law.name), worst[0], 1e-8);
        below(&format!("{}: the same, cross-section", law.name), worst[1], 1e-6);
    }
}

#[test]
fn laws_are_objective_and_have_their_symmetry() {
    for law in laws() {
        let (mut objective, mut symmetric, mut moment) = (0.0f64, 0.0f64, 0.0f64);
        for h in states(0.2, 30) {
            let f = plus_identity(&h, 1.0);
            let p = (law.stress)(&law.parameters, &h);
            let q = multiply(&rotation(0, 1.1), &multiply(&rotation(2, 2.3), &rotation(1, -0.7)));
            let turned = (law.stress)(&law.parameters, &plus_identity(&multiply(&q, &f), -1.0));
            objective = objective.max(size(&difference(&turned, &multiply(&q, &p))) / size(&p));
            let q = if law.isotropic { q } else { rotation(0, 0.9) };
            let before = (law.stress)(&law.parameters, &plus_identity(&multiply(&f, &q), -1.0));
            symmetric = symmetric.max(size(&difference(&before, &multiply(&p, &q))) / size(&p));
            let pf = multiply(&p, &transpose(&f));
            moment = moment.max(size(&difference(&pf, &transpose(&pf))) / size(&p));
        }
        below(&format!("{}: P(QF) against Q P(F)", law.name), objective, 1e-12);
        let group = if law.isotropic { "all rotations" } else { "rotations about the fibre" };
        below(&format!("{}: P(FQ) against P(F) Q, {group}", law.name), symmetric, 1e-12);
        below(&format!("{}: P Fᵀ against its transpose", law.name), moment, 1e-12);
    }
}

#[test]
fn at_rest_there_is_neither_stress_nor_energy() {
    for law in laws() {
        let rest = [[0.0; 3]; 3];
        assert_eq!(size(&(law.stress)(&law.parameters, &rest)), 0.0, "{}", law.name);
        assert_eq!((law.energy)(&law.parameters, &rest), [0.0; 4], "{}", law.name);
        let turned = plus_identity(&rotation(2, 0.5), -1.0);
        let modulus = law.parameters[0];
        below(
            &format!("{}: stress over modulus of a pure rotation", law.name),
            size(&(law.stress)(&law.parameters, &turned)) / modulus,
            1e-14,
        );
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let mut all: Vec<Tensor<f64>> = [1e-6, 1e-3, 0.1, 0.4].into_iter().flat_map(|s| states(s, 64)).collect();
    all.push([[0.0; 3]; 3]);
    all.truncate(256);
    for law in laws() {
        let expected = [(law.f32)(Isa::Scalar, &law.parameters, &all), (law.f64)(Isa::Scalar, &law.parameters, &all)];
        assert!(expected.iter().all(|e| e.len() == 256 * 13));
        for isa in Isa::available() {
            let got = [(law.f32)(isa, &law.parameters, &all), (law.f64)(isa, &law.parameters, &all)];
            assert!(got == expected, "{} on {isa:?}", law.name);
            println!("{} on {isa:?}: {} numbers in f32 and f64 equal those of one lane", law.name, 256 * 13);
        }
    }
}

/// Error of single precision by size of strain, unrotated and rotated by 30°. The state is rounded first, so the numbers show the
/// arithmetic of the law, not the rounding of its input.
#[test]
fn single_precision_keeps_small_strains() {
    let law = row::<Charmetant>("charmetant", false, px35(1e-3));
    println!("largest errors of 200 states; of the section over its mean square root stress");
    println!("strain    S11 (MPa) section | turned by 30°: S11 (MPa) section");
    for strain in [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1] {
        let mut line = vec![];
        for angle in [0.0, std::f64::consts::FRAC_PI_6] {
            let mut worst = [0.0f64; 2];
            let mut typical = 0.0;
            for h in states(strain, 200) {
                let f = multiply(&rotation(2, angle), &plus_identity(&h, 1.0));
                let h = plus_identity(&f, -1.0).map(|row| row.map(|x| f64::from(x as f32)));
                let single =
                    Charmetant::stress::<f32>(&law.parameters.map(|x| x as f32), &h.map(|row| row.map(|x| x as f32)));
                let back = inverse(&plus_identity(&h, 1.0));
                let got = multiply(&back, &single.map(|row| row.map(f64::from)));
                let expected = pk2(&law, &h);
                let apart = difference(&got, &expected);
                worst[0] = worst[0].max(apart[0][0].abs());
                worst[1] = worst[1].max(parts(&apart)[1]);
                typical += parts(&expected)[1].powi(2) / 200.0;
            }
            worst[1] /= f64::sqrt(typical);
            line.extend(worst);
        }
        println!("{strain:.0e}   {:.1e}   {:.1e}   |   {:.1e}   {:.1e}", line[0], line[1], line[2], line[3]);
        below(&format!("section at strain {strain:e}"), line[1], 3e-6);
        let whole = 108_500.0 * strain;
        below(&format!("S11 at strain {strain:e}, over K_elong times strain"), line[0] / whole, 3e-6);
        if strain == 1e-4 {
            below("section at strain 1e-4, turned by 30°", line[3], 1e-3);
            below("S11 (MPa) at strain 1e-4, turned by 30°", line[2], 4e-3);
        }
    }
}
