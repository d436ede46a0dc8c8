//! The page of a characterisation: numbers of all tests, curves of tests of the same kind on one chart, and links to their reports.

use super::parts::CARD;
use super::{Curve, Done, Given};
use crate::error::Result;
use crate::output::chart;
use crate::output::file;
use crate::output::page::Page;
use crate::output::results::short;
use crate::output::table::text as number;
use std::path::Path;

pub(super) fn write(done: &[Done], fabric: &str, path: &Path) -> Result<()> {
    let title = format!("{fabric}: characterisation");
    let mut page = Page::new(&title);
    page.heading("What the tests give");
    let mut rows = Vec::new();
    for Done { part, results, numbers, .. } in done {
        let [title, verdict] = [part.title.to_owned(), results.verdict().to_owned()];
        let time = format!("{:.1}", results.number("wall_s"));
        for Given { name, unit, value, put_in } in numbers {
            let put_in = put_in.map_or("–".into(), |put_in| short(&number(put_in)));
            let given = [name.clone(), short(&number(*value)), unit.clone(), put_in];
            rows.push([&[title.clone()][..], &given, &[verdict.clone(), time.clone()]].concat());
        }
        if numbers.is_empty() {
            rows.push([&[title][..], &["–"; 4].map(String::from), &[verdict, time]].concat());
        }
    }
    page.table(&["test", "quantity", "value", "unit", "put in", "ended", "time, s"], &rows);
    let text = "K_sh by the force of a whole yarn is low, since the free ends of its fibres carry less: see the report of the test.";
    if done.iter().flat_map(|done| &done.numbers).any(|given| given.name == "K_sh") {
        page.paragraph("soft", text);
    }
    page.heading("Curves");
    page.raw("<div class=\"charts\">");
    let figure = |page: &mut Page, of: &dyn Fn(Curve) -> bool, title: &str, axis: [&str; 2], caption: &str| {
        let curves = done.iter().filter(|done| of(done.part.curve));
        let curves =
            curves.map(|done| chart::Curve { name: done.part.name, points: done.curve.clone(), spread: Vec::new() });
        if let Some(svg) = chart::curves(axis, &curves.collect::<Vec<_>>()) {
            page.figure(title, &svg, caption);
        }
    };
    figure(
        &mut page,
        &|curve| curve == Curve::Shear,
        "Shear force F_nor, N/mm",
        ["shear angle, degrees", "N/mm"],
        "Loading and unloading. A specimen is shown over the effective angle of its zone of pure shear.",
    );
    figure(
        &mut page,
        &|curve| matches!(curve, Curve::Tension { .. }),
        "Membrane force along the fibres, N/mm",
        ["strain, %", "N/mm"],
        "The other direction is free of force. Loading and unloading.",
    );
    figure(
        &mut page,
        &|curve| curve == Curve::Compaction,
        "Pressure of the plates, MPa",
        ["thickness, mm", "MPa"],
        "Of a tightened cell, free of membrane forces.",
    );
    page.raw("</div>");
    page.heading("For a material card");
    let card = CARD.map(|need| {
        let from = done.iter().filter(|done| done.part.gives() == Some(need)).map(|done| done.part.name);
        let from = from.collect::<Vec<_>>().join(", ");
        format!("{need}: {}", if from.is_empty() { "not tested here".into() } else { format!("from {from}") })
    });
    page.list("findings", &card);
    page.heading("Reports of the tests");
    let links: String = done
        .iter()
        .map(|done| format!("<li><a href=\"{0}/report.html\">{1}</a></li>", done.part.name, done.part.title))
        .collect();
    page.raw(&format!("<ul>{links}</ul>"));
    let text = page.finish(&title);
    file::replace(path, |w| w.write_all(text.as_bytes()))
}
