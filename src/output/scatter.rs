//! Points over two logarithmic axes as a self-contained SVG: numbered marks with a key, a Pareto front, and levels.

use super::chart::escaped;
use std::fmt::Write as _;

/// A point with its entry in the key.
#[derive(Debug, Clone)]
pub struct Mark<'a> {
    pub number: usize,
    pub name: &'a str,
    /// Marks of a group look alike; `None` for a point without a group.
    pub group: Option<usize>,
    pub at: [f64; 2],
    /// Filled mark, or outline.
    pub filled: bool,
    /// Larger mark.
    pub strong: bool,
}

/// A scatter chart; only points above zero on both axes are drawn.
#[derive(Debug, Clone)]
pub struct Scatter<'a> {
    pub axes: [&'a str; 2],
    pub marks: Vec<Mark<'a>>,
    /// Points joined by a line.
    pub front: Vec<[f64; 2]>,
    /// Values of the second axis drawn as levels, with their names.
    pub lines: Vec<(f64, String)>,
}

const WIDTH: f64 = 900.0;
/// Left, top and right of the plot area, and the start of the key.
const AREA: [f64; 3] = [64.0, 16.0, 690.0];
const KEY: f64 = 712.0;
/// Height of a line of the key, and of everything below the area.
const LINE: f64 = 15.0;
const BELOW: f64 = 48.0;
const COLOURS: [&str; 8] = ["#1b5e8c", "#c2571a", "#3f7d3a", "#7a4b94", "#a8324a", "#0f7f7a", "#8a6d1f", "#555b63"];
/// A level below the lowest point by more than this factor is only listed.
const FAR: f64 = 10.0;
const INK: &str = "#23262b";
/// Size of a digit next to its mark, and the distances at which it is tried.
const DIGIT: [f64; 2] = [6.4, 10.0];
const DISTANCES: [f64; 6] = [10.0, 15.0, 21.0, 28.0, 37.0, 48.0];

/// Centre and half sizes of a drawn item.
type Box = [[f64; 2]; 2];

impl Scatter<'_> {
    /// The chart; `None` if there is no point to draw.
    pub fn svg(&self) -> Option<String> {
        let positive = |p: &[f64; 2]| p.iter().all(|x| x.is_finite() && *x > 0.0);
        let marks: Vec<&Mark> = self.marks.iter().filter(|m| positive(&m.at)).collect();
        marks.first()?;
        let lines: Vec<&(f64, String)> = self.lines.iter().filter(|l| l.0.is_finite() && l.0 > 0.0).collect();
        // a level far below all points would compress the plot
        let lowest = marks.iter().map(|m| m.at[1]).fold(f64::MAX, f64::min);
        let (lines, far): (Vec<_>, Vec<_>) = lines.into_iter().partition(|l| l.0 > lowest / FAR);
        let levels = lines.iter().map(|l| l.0);
        let xs = ticks(marks.iter().map(|m| m.at[0]));
        let ys = ticks(marks.iter().map(|m| m.at[1]).chain(levels));
        let [left, top, right] = AREA;
        let height = (430.0f64).max(top + LINE * marks.len() as f64 + 14.0);
        let bottom = height - BELOW;
        let place =
            |v: f64, [low, high]: [f64; 2], from: f64, to: f64| from + (v / low).ln() / (high / low).ln() * (to - from);
        let x = |v: f64| place(v, xs.range, left, right);
        let y = |v: f64| place(v, ys.range, bottom, top);
        let mut t = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" aria-label=\"{} over {}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            escaped(self.axes[1]),
            escaped(self.axes[0])
        );
        // writing to a String does not fail
        for v in &xs.values {
            let _ = writeln!(t, "<path d=\"M{:.1} {top}V{bottom}\" stroke=\"#e7e9ec\" fill=\"none\"/>", x(*v));
            text(&mut t, [x(*v), bottom + 17.0], "middle", 12, &plain(*v));
        }
        for v in &ys.values {
            let _ = writeln!(t, "<path d=\"M{left} {:.1}H{right}\" stroke=\"#e7e9ec\" fill=\"none\"/>", y(*v));
            text(&mut t, [left - 7.0, y(*v) + 4.0], "end", 12, &plain(*v));
        }
        let _ = writeln!(t, "<path d=\"M{left} {top}V{bottom}H{right}\" stroke=\"#8b929b\" fill=\"none\"/>");
        text(&mut t, [0.5 * (left + right), height - 12.0], "middle", 13, self.axes[0]);
        let middle = 0.5 * (top + bottom);
        let _ = writeln!(t, "<g transform=\"rotate(-90 15 {middle:.1})\">");
        text(&mut t, [15.0, middle], "middle", 13, self.axes[1]);
        t.push_str("</g>\n");
        let mut taken: Vec<Box> = Vec::new();
        for (value, name) in lines {
            let at = y(*value);
            let _ = writeln!(
                t,
                "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#8b929b\" stroke-dasharray=\"6 4\" fill=\"none\"/>"
            );
            text(&mut t, [right - 4.0, at - 5.0], "end", 11, name);
            let half = 3.2 * name.chars().count() as f64;
            taken.push([[right - 4.0 - half, at - 9.0], [half, 6.0]]);
        }
        for (line, (_, name)) in far.into_iter().enumerate() {
            text(&mut t, [right - 4.0, bottom - 6.0 - LINE * line as f64], "end", 11, &format!("{name}, below"));
        }
        let joined: Vec<String> =
            self.front.iter().filter(|p| positive(p)).map(|p| format!("{:.1} {:.1}", x(p[0]), y(p[1]))).collect();
        if joined.len() > 1 {
            let _ =
                writeln!(t, "<path d=\"M{}\" stroke=\"{INK}\" stroke-width=\"1.3\" fill=\"none\"/>", joined.join("L"));
        }
        taken.extend(marks.iter().map(|m| [[x(m.at[0]), y(m.at[1])], [m.radius() + 1.0; 2]]));
        for (row, mark) in marks.iter().enumerate() {
            let at = [x(mark.at[0]), y(mark.at[1])];
            let label = mark.number.to_string();
            let size = [0.5 * DIGIT[0] * label.len() as f64, 0.5 * DIGIT[1]];
            let own = free(at, size, &taken, [left, top, right, bottom]);
            taken.push([own, size]);
            if libm::hypot(own[0] - at[0], own[1] - at[1]) > DISTANCES[1] + 1.0 {
                let _ = writeln!(
                    t,
                    "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"#b5bac1\" stroke-width=\"0.8\"/>",
                    at[0], at[1], own[0], own[1]
                );
            }
            mark.draw(&mut t, at);
            text(&mut t, [own[0], own[1] + 4.0], "middle", 11, &label);
            let line = top + 8.0 + LINE * row as f64;
            mark.draw(&mut t, [KEY, line - 4.0]);
            text(&mut t, [KEY + 28.0, line], "end", 11, &label);
            text(&mut t, [KEY + 35.0, line], "start", 12, mark.name);
        }
        t.push_str("</svg>\n");
        Some(t)
    }
}

impl Mark<'_> {
    fn radius(&self) -> f64 {
        if self.strong { 6.0 } else { 4.0 }
    }

    /// Groups differ in colour and, when the colours are used up, in shape.
    fn draw(&self, t: &mut String, [x, y]: [f64; 2]) {
        let (colour, square) =
            self.group.map_or((INK, false), |g| (COLOURS[g % COLOURS.len()], g / COLOURS.len() % 2 == 1));
        let (r, fill) = (self.radius(), if self.filled { colour } else { "#fff" });
        let name = escaped(self.name);
        let style = format!("fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1.6\"><title>{name}</title>");
        // writing to a String does not fail
        let _ = if square {
            let (x, y, size) = (x - 0.9 * r, y - 0.9 * r, 1.8 * r);
            writeln!(t, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{size:.1}\" height=\"{size:.1}\" {style}</rect>")
        } else {
            writeln!(t, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" {style}</circle>")
        };
    }
}

fn text(t: &mut String, [x, y]: [f64; 2], anchor: &str, size: u32, content: &str) {
    let content = escaped(content);
    let font = format!("font:{size}px system-ui,'DejaVu Sans',sans-serif;fill:{INK}");
    // writing to a String does not fail
    let _ = writeln!(t, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" style=\"{font}\">{content}</text>");
}

/// A free position for a label near a mark; right of the mark if there is none.
fn free([x, y]: [f64; 2], size: [f64; 2], taken: &[Box], [left, top, right, bottom]: [f64; 4]) -> [f64; 2] {
    let places = DISTANCES.iter().flat_map(|r| (0..12).map(move |k| (*r, f64::from(k) * std::f64::consts::FRAC_PI_6)));
    let mut places = places.map(|(r, turn)| [x + r * libm::cos(turn), y - r * libm::sin(turn)]);
    let inside = |p: &[f64; 2]| {
        p[0] - size[0] > left && p[0] + size[0] < right && p[1] - size[1] > top && p[1] + size[1] < bottom
    };
    let clear =
        |p: &[f64; 2]| !taken.iter().any(|[middle, half]| (0..2).all(|k| (p[k] - middle[k]).abs() < size[k] + half[k]));
    places.find(|p| inside(p) && clear(p)).unwrap_or([x + DISTANCES[0], y])
}

/// Round values of a logarithmic axis, and its range.
struct Ticks {
    values: Vec<f64>,
    range: [f64; 2],
}

/// Ticks at 1, 2 and 5 of each decade that has values, or closer ones if these are too few.
fn ticks(values: impl Iterator<Item = f64>) -> Ticks {
    let (low, high) = values.fold((f64::MAX, f64::MIN_POSITIVE), |(l, h), v| (l.min(v), h.max(v)));
    let range = [low / 1.25, high * 1.25];
    let at = |steps: &[f64]| -> Vec<f64> {
        let decades = (range[0].log10().floor() as i32)..=(range[1].log10().ceil() as i32);
        let values = decades.flat_map(|d| steps.iter().map(move |m| m * 10f64.powi(d)));
        values.filter(|v| (range[0]..=range[1]).contains(v)).collect()
    };
    let few = at(&[1.0, 2.0, 5.0]);
    let values = if few.len() > 2 { few } else { at(&[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]) };
    Ticks { values, range }
}

/// A round value without needless digits.
fn plain(value: f64) -> String {
    if (1e-3..1e5).contains(&value) { format!("{}", (value * 1e6).round() / 1e6) } else { format!("{value:.0e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(number: usize, at: [f64; 2]) -> Mark<'static> {
        Mark { number, name: "a < b", group: Some(number), at, filled: number.is_multiple_of(2), strong: false }
    }

    #[test]
    fn points_levels_and_key_are_drawn_and_nothing_below_zero() {
        let marks = vec![mark(1, [0.5, 3.0]), mark(12, [2.0, 0.4]), mark(3, [1.0, 0.0]), mark(4, [f64::NAN, 1.0])];
        let lines = vec![(0.1, "by chance".to_owned()), (f64::NAN, "none".to_owned())];
        let chart = Scatter { axes: ["time", "error"], marks, front: vec![[0.5, 3.0], [2.0, 0.4]], lines };
        let svg = chart.svg().unwrap();
        // each of the two points is in the area and in the key
        assert_eq!(svg.matches("<title>a &lt; b</title>").count(), 4);
        assert!(svg.contains("by chance") && !svg.contains("none<"));
        assert_eq!(svg.matches("stroke-width=\"1.3\"").count(), 1);
        let far = Scatter { lines: vec![(0.01, "by chance".to_owned())], ..chart.clone() }.svg().unwrap();
        assert!(far.contains("by chance, below") && !far.contains("dasharray") && svg.contains("dasharray"));
        assert!(Scatter { marks: vec![mark(1, [0.0, 1.0])], ..chart }.svg().is_none());
    }

    #[test]
    fn labels_of_a_heap_of_points_stay_apart() {
        let (area, size) = ([0.0, 0.0, 400.0, 400.0], [6.0, 5.0]);
        let marks: Vec<[f64; 2]> =
            (0..12).map(|k| [200.0 + 3.0 * f64::from(k % 4), 200.0 + 4.0 * f64::from(k / 4)]).collect();
        let mut taken: Vec<Box> = marks.iter().map(|at| [*at, [5.0; 2]]).collect();
        for at in marks {
            let own = free(at, size, &taken, area);
            assert!(
                taken.iter().all(|[m, half]| (0..2).any(|k| (own[k] - m[k]).abs() >= size[k] + half[k])),
                "{own:?}"
            );
            taken.push([own, size]);
        }
    }

    #[test]
    fn ticks_are_round() {
        let found = ticks([0.3, 40.0].into_iter());
        assert_eq!(found.values, [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(ticks([130.0, 157.0].into_iter()).values, [120.0, 150.0]);
        assert_eq!((plain(0.05), plain(20.0)), ("0.05".to_owned(), "20".to_owned()));
    }
}
