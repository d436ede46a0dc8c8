//! A self-contained HTML page: style, charts and pictures are embedded, nothing is fetched.

use super::chart::escaped;
use crate::case::parse::reason;
use crate::error::{Error, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write as _;
use std::path::Path;

/// A page under construction.
#[derive(Debug, Default)]
pub struct Page {
    body: String,
}

impl Page {
    /// A page with the title as its first line.
    pub fn new(title: &str) -> Self {
        Self { body: format!("<h1>{}</h1>\n", escaped(title)) }
    }

    /// Adds markup verbatim.
    pub fn raw(&mut self, markup: &str) {
        self.body.push_str(markup);
        self.body.push('\n');
    }

    pub fn heading(&mut self, text: &str) {
        self.raw(&format!("<h2>{}</h2>", escaped(text)));
    }

    pub fn paragraph(&mut self, class: &str, text: &str) {
        self.raw(&format!("<p class=\"{class}\">{}</p>", escaped(text)));
    }

    /// Adds names with one value each.
    pub fn facts(&mut self, facts: &[(&str, String)]) {
        let fact = |(name, value): &(&str, String)| {
            format!("<div><dt>{}</dt><dd>{}</dd></div>", escaped(name), escaped(value))
        };
        self.raw(&format!("<dl class=\"facts\">{}</dl>", facts.iter().map(fact).collect::<String>()));
    }

    pub fn list(&mut self, class: &str, items: &[String]) {
        let items: String = items.iter().map(|item| format!("<li>{}</li>", escaped(item))).collect();
        self.raw(&format!("<ul class=\"{class}\">{items}</ul>"));
    }

    /// Adds a chart with a title and a caption.
    pub fn figure(&mut self, title: &str, svg: &str, caption: &str) {
        let (title, caption) = (escaped(title), escaped(caption));
        self.raw(&format!("<figure><h3>{title}</h3>{svg}<figcaption>{caption}</figcaption></figure>"));
    }

    /// Embeds a PNG.
    pub fn picture(&mut self, path: &Path, caption: &str) -> Result<()> {
        let bytes = std::fs::read(path).map_err(|e| Error::file(path, reason(&e)))?;
        let (data, caption) = (STANDARD.encode(bytes), escaped(caption));
        self.raw(&format!(
            "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>"
        ));
        Ok(())
    }

    pub fn table(&mut self, header: &[&str], rows: &[Vec<String>]) {
        let line = |tag: &str, cells: &mut dyn Iterator<Item = String>| {
            cells.fold(String::new(), |mut t, cell| {
                // writing to a String does not fail
                let _ = write!(t, "<{tag}>{}</{tag}>", escaped(&cell));
                t
            })
        };
        let head = line("th", &mut header.iter().map(|h| (*h).to_owned()));
        let body: String =
            rows.iter().map(|row| format!("<tr>{}</tr>\n", line("td", &mut row.iter().cloned()))).collect();
        self.raw(&format!("<div class=\"wide\"><table>\n<tr>{head}</tr>\n{body}</table></div>"));
    }

    /// Adds text that opens on demand.
    pub fn details(&mut self, summary: &str, text: &str) {
        self.raw(&format!("<details><summary>{}</summary><pre>{}</pre></details>", escaped(summary), escaped(text)));
    }

    /// The whole document.
    pub fn finish(self, title: &str) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
             <style>\n{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
            escaped(title),
            include_str!("report.css"),
            self.body
        )
    }
}
