//! Symmetric positive definite tridiagonal systems, cyclic or not, side by side: one system per lane.
//!
//! LDLᵀ with the last row as a border, to which the first row couples in a cyclic system and the last but one in any. All
//! systems end in the same row. A shorter one is preceded by rows of the unit matrix with a zero right side, which change no bit
//! of it: each system is solved with the same operations as alone.

use crate::elements::LANES;
use crate::kernel::lane::{Lane, Real};

/// Diagonal of a row.
pub const DIAGONAL: usize = 0;
/// Coupling to the next row.
pub const COUPLING: usize = 1;
/// Right side; after the solution, the unknown.
pub const RIGHT: usize = 2;
/// Coupling to the last row through the cycle; only that of the first row is given.
pub const BORDER: usize = 3;
/// Numbers per row.
const COLUMNS: usize = 4;

/// Up to sixteen systems of two rows or more.
pub struct Systems<'a, R> {
    /// By register, row, column and lane.
    numbers: &'a mut [R],
    /// Rows of the longest system.
    rows: usize,
    /// Lanes per register.
    width: usize,
    /// First row of the system in each lane; a lane without a system has unit rows only.
    starts: [usize; LANES],
}

impl<'a, R: Real> Systems<'a, R> {
    /// Lanes per register. One system alone is solved number by number.
    #[inline(always)]
    fn width<L: Lane<Scalar = R>>(systems: usize) -> usize {
        if systems == 1 { 1 } else { L::WIDTH }
    }

    /// Size of the work space for systems of up to `rows` rows.
    #[inline(always)]
    pub fn space<L: Lane<Scalar = R>>(systems: usize, rows: usize) -> usize {
        COLUMNS * rows * systems.next_multiple_of(Self::width::<L>(systems))
    }

    /// Systems with `counts` rows, at most `rows`, in a work space with numbers of any value. Their own rows are not set yet.
    #[inline(always)]
    pub fn new<L: Lane<Scalar = R>>(numbers: &'a mut [R], rows: usize, counts: &[usize]) -> Self {
        assert_eq!(numbers.len(), Self::space::<L>(counts.len(), rows));
        let width = Self::width::<L>(counts.len());
        let mut systems = Self { numbers, rows, width, starts: [rows; LANES] };
        for (start, count) in systems.starts.iter_mut().zip(counts) {
            *start = rows - count;
        }
        for lane in 0..counts.len().next_multiple_of(width) {
            for (column, number) in [(DIAGONAL, 1.0), (COUPLING, 0.0), (RIGHT, 0.0), (BORDER, 0.0)] {
                let (place, step) = systems.column(lane, 0, column);
                for row in 0..systems.starts[lane] {
                    systems.numbers[place + row * step] = R::from_f64(number);
                }
            }
        }
        systems
    }

    /// Sets a column in consecutive rows of a system, from its row `first`.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, column: usize, first: usize, values: &[R]) {
        let (place, step) = self.column(lane, self.starts[lane] + first, column);
        for i in 0..values.len() {
            self.numbers[place + i * step] = values[i];
        }
    }

    /// The unknowns of a system, after the solution.
    #[inline(always)]
    pub fn solution(&self, lane: usize, to: &mut [R]) {
        let (place, step) = self.column(lane, self.starts[lane], RIGHT);
        for i in 0..to.len() {
            to[i] = self.numbers[place + i * step];
        }
    }

    /// Index of a number of a row in the work space, and the distance to that of the next row.
    #[inline(always)]
    fn column(&self, lane: usize, row: usize, column: usize) -> (usize, usize) {
        let (register, lane) = (lane / self.width, lane % self.width);
        (((register * self.rows + row) * COLUMNS + column) * self.width + lane, COLUMNS * self.width)
    }

    /// Solves all systems.
    #[inline(always)]
    pub fn solve<L: Lane<Scalar = R>>(&mut self) {
        let mut starts = [R::from_f64(0.0); LANES];
        for (number, start) in starts.iter_mut().zip(self.starts) {
            *number = R::from_i32(start as i32);
        }
        let size = COLUMNS * self.rows * self.width;
        for register in 0..self.numbers.len() / size {
            let numbers = &mut self.numbers[register * size..][..size];
            if self.width == 1 {
                eliminate::<R>(numbers, starts[register]);
            } else {
                eliminate::<L>(numbers, L::load(&starts[register * L::WIDTH..]));
            }
        }
    }
}

/// A column of a row.
#[inline(always)]
fn get<L: Lane>(row: &[L::Scalar], column: usize) -> L {
    L::load(&row[column * L::WIDTH..])
}

#[inline(always)]
fn put<L: Lane>(row: &mut [L::Scalar], column: usize, value: L) {
    value.store(&mut row[column * L::WIDTH..]);
}

/// Solves the systems of a register that begin at rows `starts`. Inverses replace the diagonals, and unknowns the right sides.
#[inline(always)]
fn eliminate<L: Lane>(numbers: &mut [L::Scalar], starts: L) {
    let size = COLUMNS * L::WIDTH;
    let last = numbers.len() / size - 1;
    let (top, bottom) = (&numbers[..size], &numbers[last * size..][..size]);
    let (mut diagonal, mut right, mut border): (L, L, L) = (get(top, DIAGONAL), get(top, RIGHT), get(top, BORDER));
    let (mut last_diagonal, mut last_right): (L, L) = (get(bottom, DIAGONAL), get(bottom, RIGHT));
    for i in 0..last {
        let (row, next) = numbers[i * size..][..2 * size].split_at_mut(size);
        let coupling: L = get(row, COUPLING);
        if i + 1 == last {
            border = border + coupling;
        }
        let inverse = L::new(1.0) / diagonal;
        let share = border * inverse;
        last_diagonal = last_diagonal - share * border;
        last_right = last_right - share * right;
        put(row, DIAGONAL, inverse);
        put(row, RIGHT, right);
        put(row, BORDER, border);
        if i + 1 < last {
            let factor = coupling * inverse;
            diagonal = get::<L>(next, DIAGONAL) - factor * coupling;
            right = get::<L>(next, RIGHT) - factor * right;
            // up to the first row of a system, its border is what was given
            let is_before = L::new(i as f64).lt(starts);
            border = L::select(is_before, get(next, BORDER), -(factor * border));
        }
    }
    let end = last_right / last_diagonal;
    put(&mut numbers[last * size..][..size], RIGHT, end);
    let mut next = end;
    for i in (0..last).rev() {
        let row = &mut numbers[i * size..][..size];
        let mut rest: L = get(row, RIGHT);
        if i + 1 < last {
            rest = rest - get::<L>(row, COUPLING) * next;
        }
        rest = rest - get::<L>(row, BORDER) * end;
        next = rest * get(row, DIAGONAL);
        put(row, RIGHT, next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::lane::{Isa, Work};

    /// Diagonal, coupling to the next row and right side of each row; the last row of a cyclic system couples to the first.
    type Rows = Vec<[f32; 3]>;

    struct Solve<'a>(&'a [Rows], &'a mut Vec<Vec<f32>>);

    impl Work<f32> for Solve<'_> {
        const WIDE: bool = true;
        fn run<L: Lane<Scalar = f32>>(self) {
            let Self(given, found) = self;
            let counts: Vec<usize> = given.iter().map(Vec::len).collect();
            let rows = *counts.iter().max().unwrap();
            let mut numbers = vec![f32::NAN; Systems::space::<L>(given.len(), rows)];
            let mut systems = Systems::new::<L>(&mut numbers, rows, &counts);
            for (lane, rows) in given.iter().enumerate() {
                for column in [DIAGONAL, COUPLING, RIGHT] {
                    systems.set(lane, column, 0, &rows.iter().map(|row| row[column]).collect::<Vec<_>>());
                }
                systems.set(lane, BORDER, 0, &[rows[rows.len() - 1][COUPLING]]);
            }
            systems.solve::<L>();
            for (lane, rows) in given.iter().enumerate() {
                found.push(vec![f32::NAN; rows.len()]);
                systems.solution(lane, &mut found[lane]);
            }
        }
    }

    fn solved(isa: Isa, given: &[Rows]) -> Vec<Vec<f32>> {
        let mut found = Vec::new();
        f32::dispatch(isa, Solve(given, &mut found));
        found
    }

    /// Systems of these lengths, cyclic where that takes three rows or more, in turn; the right sides of the first are −0.
    fn some(lengths: &[usize]) -> Vec<Rows> {
        let mut seed = 1u32;
        let mut draw = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let system = |(number, length): (usize, &usize)| {
            let cyclic = number % 2 == 0 && *length > 2;
            let row = |i| {
                let right = draw();
                [
                    1.5 + draw(),
                    if i + 1 < *length || cyclic { draw() } else { 0.0 },
                    if number == 0 { -0.0 } else { right },
                ]
            };
            (0..*length).map(row).collect()
        };
        lengths.iter().enumerate().map(system).collect()
    }

    #[test]
    fn a_system_has_the_same_bits_alone_and_beside_longer_ones() {
        let bits = |x: &Vec<f32>| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for lengths in [&[3, 40, 7, 2, 23][..], &[5; 16], &[17, 2, 3, 9, 4, 30, 16, 11, 3]] {
            let given = some(lengths);
            let alone: Vec<_> = given.iter().map(|rows| solved(Isa::Scalar, std::slice::from_ref(rows))).collect();
            for (rows, x) in given.iter().zip(alone.iter().flatten()) {
                for (i, [diagonal, coupling, right]) in rows.iter().enumerate() {
                    let (next, previous) = ((i + 1) % rows.len(), (i + rows.len() - 1) % rows.len());
                    let left = diagonal * x[i] + coupling * x[next] + rows[previous][COUPLING] * x[previous];
                    assert!((left - right).abs() < 1e-4, "{left} {right}");
                }
            }
            for isa in Isa::available() {
                for (alone, beside) in alone.iter().flatten().zip(solved(isa, &given)) {
                    assert_eq!(bits(alone), bits(&beside), "{isa:?}");
                }
            }
        }
    }
}
