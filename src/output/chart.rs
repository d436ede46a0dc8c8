//! Charts as SVG: curves over a common axis, and maps of coloured points. A page adds style, but the charts are readable
//! without it.

use super::colour;
use std::fmt::Write as _;

/// A curve: its name, its points and, if known, the spread to either side of each point. NaN points interrupt the curve.
#[derive(Debug, Clone)]
pub struct Curve<'a> {
    pub name: &'a str,
    pub points: Vec<[f64; 2]>,
    pub spread: Vec<f64>,
}

impl Curve<'_> {
    /// Points with a known spread: abscissa, and both ends of the band.
    fn band(&self) -> Vec<[f64; 3]> {
        let all = self.points.iter().zip(&self.spread).map(|([x, y], s)| [*x, y - s, y + s]);
        all.filter(|ends| ends.iter().all(|v| v.is_finite())).collect()
    }
}

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 330.0;
/// Height of a line of the legend.
const LINE: f64 = 19.0;
/// Left, top, right and bottom of the plot area.
const AREA: [f64; 4] = [60.0, 32.0, 506.0, 276.0];
/// Colours that most eyes can distinguish, and dashes for black-and-white print.
const COLOURS: [&str; 6] = ["#1b5e8c", "#c2571a", "#3f7d3a", "#7a4b94", "#8a6d1f", "#555b63"];
const DASHES: [&str; 6] = ["none", "7 3", "2 3", "9 3 2 3", "4 2", "1 2"];

/// Curves over an axis; `None` if there is no point to draw.
pub fn curves(axis: [&str; 2], curves: &[Curve]) -> Option<String> {
    let finite = |p: &&[f64; 2]| p[0].is_finite() && p[1].is_finite();
    let points = || curves.iter().flat_map(|c| &c.points).filter(finite).copied();
    points().next()?;
    let bands: Vec<Vec<[f64; 3]>> = curves.iter().map(Curve::band).collect();
    let ends = || bands.iter().flatten().flat_map(|[x, low, high]| [[*x, *low], [*x, *high]]);
    let range = |k: usize| {
        let (low, high) = points().chain(ends()).fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        // the axis includes zero, so that a curve on one side of it is shown with it
        let (low, high) = (low.min(0.0), high.max(0.0));
        if high > low { (low, high) } else { (low, low + 1.0) }
    };
    let (xs, ys) = (ticks(range(0)), ticks(range(1)));
    let outer = |t: &[f64]| (t[0], t[t.len() - 1]);
    let (x_range, y_range) = (outer(&xs), outer(&ys));
    // the legend takes as many lines as it needs
    let mut places = Vec::new();
    let (mut pen, mut line) = (AREA[0], 0);
    for curve in curves {
        let width = 50.0 + 8.2 * curve.name.chars().count() as f64;
        if pen + width > WIDTH && pen > AREA[0] {
            (pen, line) = (AREA[0], line + 1);
        }
        places.push([pen, 16.0 + LINE * f64::from(line)]);
        pen += width;
    }
    let down = LINE * f64::from(line);
    let ([left, top, right, bottom], height) = ([AREA[0], AREA[1] + down, AREA[2], AREA[3] + down], HEIGHT + down);
    let x = |v: f64| left + (v - x_range.0) / (x_range.1 - x_range.0) * (right - left);
    let y = |v: f64| bottom - (v - y_range.0) / (y_range.1 - y_range.0) * (bottom - top);
    let mut t = format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{} over {}\">",
        escaped(axis[1]),
        escaped(axis[0])
    );
    // writing to a String does not fail
    for v in &xs {
        let at = x(*v);
        let _ = write!(t, "<path class=\"g\" fill=\"none\" stroke=\"#d9dce0\" d=\"M{at:.1} {top}V{bottom}\"/>");
        let _ = write!(
            t,
            "<text x=\"{at:.1}\" y=\"{:.1}\" class=\"m\" text-anchor=\"middle\">{}</text>",
            bottom + 18.0,
            label(*v, &xs)
        );
    }
    for v in &ys {
        let at = y(*v);
        let _ = write!(t, "<path class=\"g\" fill=\"none\" stroke=\"#d9dce0\" d=\"M{left} {at:.1}H{right}\"/>");
        let _ = write!(
            t,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"e\" text-anchor=\"end\">{}</text>",
            left - 7.0,
            at + 4.5,
            label(*v, &ys)
        );
    }
    let _ =
        write!(t, "<path class=\"a\" fill=\"none\" stroke=\"#8b929b\" d=\"M{left:.1} {0:.1}H{right:.1}\"/>", y(0.0));
    let _ = write!(
        t,
        "<text x=\"{:.1}\" y=\"{:.1}\" class=\"m\" text-anchor=\"middle\">{}</text>",
        0.5 * (left + right),
        height - 12.0,
        escaped(axis[0])
    );
    for (k, (curve, [pen, high])) in curves.iter().zip(places).enumerate() {
        if let Some((first, rest)) = bands[k].split_first() {
            let mut edge = format!("M{:.1} {:.1}", x(first[0]), y(first[2]));
            let back = bands[k].iter().rev().map(|p| (p[0], p[1]));
            for (at, value) in rest.iter().map(|p| (p[0], p[2])).chain(back) {
                let _ = write!(edge, "L{:.1} {:.1}", x(at), y(value));
            }
            let _ = write!(t, "<path fill=\"{}\" fill-opacity=\"0.15\" d=\"{edge}Z\"/>", COLOURS[k % 6]);
        }
        let style = format!("stroke=\"{}\" stroke-dasharray=\"{}\"", COLOURS[k % 6], DASHES[k % 6]);
        let mut line = String::new();
        let mut down = false;
        for p in &curve.points {
            let draws = finite(&p);
            if draws {
                let _ = write!(line, "{}{:.1} {:.1}", if down { "L" } else { "M" }, x(p[0]), y(p[1]));
            }
            down = draws;
        }
        let _ = write!(t, "<path class=\"c\" fill=\"none\" {style} d=\"{line}\"/>");
        let _ = write!(t, "<path class=\"c\" fill=\"none\" {style} d=\"M{pen:.1} {high}h26\"/>");
        let _ = write!(t, "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>", pen + 32.0, high + 4.5, escaped(curve.name));
    }
    t.push_str("</svg>");
    Some(t)
}

/// Points in the plane, mm, coloured by value, with a colour range; `None` if there is no point. The default `range` is the
/// range of the values.
pub fn map(name: &str, points: &[[f64; 3]], range: Option<[f64; 2]>) -> Option<String> {
    let known: Vec<&[f64; 3]> = points.iter().filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let extent = |k: usize| known.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
    known.first()?;
    let ([x0, x1], [y0, y1]): ([f64; 2], [f64; 2]) = (extent(0).into(), extent(1).into());
    let [low, high] = range.unwrap_or(extent(2).into());
    let (wide, tall): (f64, f64) = (x1 - x0, y1 - y0);
    let spacing = (wide.max(1.0) * tall.max(1.0) / known.len() as f64).sqrt();
    let (wide, tall) = (wide + 2.0 * spacing, tall + 2.0 * spacing);
    let scale = (WIDTH / wide).min(400.0 / tall);
    let (left, height) = (0.5 * (WIDTH - scale * wide), scale * tall + 44.0);
    let radius = (0.36 * spacing * scale).clamp(1.5, 16.0);
    let mut t =
        format!("<svg viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" aria-label=\"map of {}\">", escaped(name));
    let shade = |v: f64| {
        let [r, g, b] = colour::encode(colour::map(if high > low {
            ((v - low) / (high - low)).clamp(0.0, 1.0) as f32
        } else {
            0.5
        }));
        format!("#{r:02x}{g:02x}{b:02x}")
    };
    // writing to a String does not fail
    for [x, y, v] in &known {
        let at = [left + scale * (x - x0 + spacing), scale * (y1 - y + spacing)];
        let colour = shade(*v);
        let _ = write!(t, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius:.1}\" fill=\"{colour}\">", at[0], at[1]);
        let _ = write!(t, "<title>{v:.4} at ({x:.2}, {y:.2}) mm</title></circle>");
    }
    let bar = height - 34.0;
    for k in 0..60 {
        let colour = shade(low + (high - low) * (f64::from(k) + 0.5) / 60.0);
        let _ = write!(
            t,
            "<rect x=\"{:.1}\" y=\"{bar:.1}\" width=\"5.2\" height=\"10\" fill=\"{colour}\"/>",
            110.0 + 5.0 * f64::from(k)
        );
    }
    // to a twentieth of the range
    let ends = [high, high - (high - low) / 20.0];
    let _ = write!(
        t,
        "<text x=\"102\" y=\"{:.1}\" class=\"e\" text-anchor=\"end\">{}</text>",
        bar + 9.5,
        label(low, &ends)
    );
    let _ = write!(t, "<text x=\"418\" y=\"{:.1}\">{}</text>", bar + 9.5, label(high, &ends));
    let _ = write!(
        t,
        "<text x=\"260\" y=\"{:.1}\" class=\"m\" text-anchor=\"middle\">{}</text></svg>",
        bar + 27.0,
        escaped(name)
    );
    Some(t)
}

/// Five to ten round values that enclose a range, except for a tenth of a step at its low end.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let step = round_step((high - low) / 6.0);
    let (first, last) = ((low / step + 0.1).floor() as i64, (high / step - 1e-9).ceil() as i64);
    (first..=last.max(first + 1)).map(|i| i as f64 * step).collect()
}

/// Smallest value of 1, 2 or 5 times a power of ten that is at least `rough`.
pub fn round_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough * (1.0 - 1e-9)).unwrap_or(rough)
}

/// A tick label with as many digits as its neighbours need.
pub fn label(value: f64, all: &[f64]) -> String {
    let step = (all[all.len().min(2) - 1] - all[0]).abs();
    let largest = all.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&largest) {
        return format!("{value:.1e}").replace('-', "−");
    }
    let digits = if step > 0.0 { (-step.log10()).ceil().clamp(0.0, 6.0) as usize } else { 3 };
    format!("{value:.digits$}").replace('-', "−")
}

/// Text escaped for HTML.
pub fn escaped(text: &str) -> String {
    super::vtu::escaped(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_enclose_the_range() {
        assert_eq!(ticks((0.0, 50.0)), [0.0, 10.0, 20.0, 30.0, 40.0, 50.0]);
        let t = ticks((-0.013, 0.11));
        assert!(t[0] <= -0.013 && t[t.len() - 1] >= 0.11 && t.contains(&0.0) && t.len() < 12, "{t:?}");
        assert_eq!(label(0.02, &[0.0, 0.02]), "0.02");
        assert_eq!(label(-20.0, &[-20.0, -10.0]), "−20");
    }

    #[test]
    fn points_stand_where_they_belong_and_gaps_interrupt() {
        let points = vec![[0.0, 0.0], [5.0, f64::NAN], [10.0, 6.0], [20.0, 6.0]];
        let svg = curves(["x", "y"], &[Curve { name: "a < b", points, spread: Vec::new() }]).unwrap();
        let [left, _, right, bottom] = AREA;
        assert!(svg.contains(&format!("M{left:.1} {bottom:.1}M")) && svg.contains(&format!("L{right:.1} ")), "{svg}");
        assert!(svg.contains("a &lt; b"));
        assert!(
            curves(["x", "y"], &[Curve { name: "a", points: vec![[f64::NAN, 1.0]], spread: Vec::new() }]).is_none()
        );
        let wide = Curve { name: "a", points: vec![[0.0, 1.0], [1.0, 1.0]], spread: vec![0.5, f64::NAN] };
        let svg = curves(["x", "y"], &vec![wide; 12]).unwrap();
        assert_eq!(svg.matches("fill-opacity").count(), 12);
        // 12 names of one letter take two lines, and the picture grows by the second
        assert!(svg.contains("viewBox=\"0 0 520 349\"") && svg.contains(">1.5</text>"), "{svg}");
        assert!(map("γ", &[], None).is_none());
        let points = [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [2.0, 0.0, 9.0]];
        assert_eq!(map("γ", &points, None).unwrap().matches("<circle").count(), 3);
        let colours = |svg: &str| {
            let fills = svg.split("fill=\"").skip(1).map(|f| f[..7].to_owned());
            fills.take(3).collect::<Vec<_>>()
        };
        let [whole, part] = [None, Some([1.0, 2.0])].map(|range| colours(&map("γ", &points, range).unwrap()));
        assert!(whole[1] != whole[2] && part[1] == part[2], "values beyond the range have the colour of its end");
    }
}
