//! A document: paragraphs, tables and charts, with a writer of text for a terminal and one of HTML for the page.

use super::style::Style;
use super::table::{PAGE_WIDTH, finish, narrow, table};
use crate::lab::chart::Chart;
use crate::lab::picture::svg::escaped;
use crate::lab::units::wrapped;

/// How a text is meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// As it stands.
    #[default]
    Plain,
    /// The first sentences.
    Lead,
    /// An explanation.
    Soft,
    /// A failure or a warning.
    Bad,
    /// Within every tolerance.
    Good,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Tone::Plain => "",
            Tone::Lead => "lead",
            Tone::Soft => "soft",
            Tone::Bad => "bad",
            Tone::Good => "ok",
        }
    }
}

/// On a page, cells with more characters than this break between words.
const LONG: usize = 22;

/// A cell of a table.
#[derive(Clone, Debug, Default)]
pub struct DocCell {
    /// Its text.
    pub text: String,
    /// On a page: shown when the mouse is over it.
    pub title: String,
    /// How it is meant.
    pub tone: Tone,
    /// On a page: a marker before the text.
    pub style: Option<Style>,
    /// On a page: where it leads; empty for nowhere.
    pub link: String,
    /// On a page: CSS of the cell.
    pub css: String,
}

impl<T: Into<String>> From<T> for DocCell {
    fn from(text: T) -> DocCell {
        DocCell { text: text.into(), ..DocCell::default() }
    }
}

impl DocCell {
    /// The name of a solver, with its marker.
    pub fn solver(name: &str) -> DocCell {
        DocCell { style: Some(Style::of(name)), ..name.into() }
    }

    /// The name of a scene, which leads to its charts.
    pub fn scene(name: &str) -> DocCell {
        DocCell { link: anchor(name), ..name.into() }
    }

    /// The same cell in another tone.
    pub fn tone(self, tone: Tone) -> DocCell {
        DocCell { tone, ..self }
    }

    fn html(&self, element: &str, left: bool) -> String {
        let mut classes = vec![self.tone.class()];
        classes.extend(left.then_some("left"));
        classes.extend((self.text.chars().count() > LONG).then_some("long"));
        let classes = classes.join(" ");
        let attribute = |name: &str, value: &str| match value.trim() {
            "" => String::new(),
            value => format!(" {name}=\"{}\"", escaped(value)),
        };
        let mut text = escaped(&self.text);
        if !self.link.is_empty() {
            text = format!("<a href=\"#{}\">{text}</a>", self.link);
        }
        if let Some(Style { color, marker }) = self.style {
            let color = if color == "#222222" { "var(--black)" } else { color };
            let path = marker.path([7.0, 7.0], 5.0);
            let svg = format!(
                "<svg class=\"mark\" viewBox=\"0 0 14 14\"><path d=\"{path}\" fill=\"{color}\"/></svg>"
            );
            text = svg + &text;
        }
        let attributes = [("class", &classes), ("title", &self.title), ("style", &self.css)];
        let attributes: String = attributes.into_iter().map(|(name, value)| attribute(name, value)).collect();
        format!("<{element}{attributes}>{text}")
    }
}

/// Anchor of a scene on the page.
pub fn anchor(scene: &str) -> String {
    let safe = scene.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("scene-{}", safe.collect::<String>())
}

/// A table.
#[derive(Clone, Debug, Default)]
pub struct DocTable {
    /// Text above it.
    pub caption: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Cells.
    pub rows: Vec<Vec<DocCell>>,
    /// Number of columns that are aligned at the left; others are at the right.
    pub left: usize,
    /// As text: whether it may be wider than a terminal page.
    pub wide: bool,
    /// As text: only so many rows; all for 0.
    pub most: usize,
    /// Whether it is on pages only.
    pub page_only: bool,
    /// On a page: the words that unfold it; empty if it is not folded.
    pub folded: String,
    /// On a page: its CSS class.
    pub class: &'static str,
}

impl DocTable {
    /// A table without rows.
    pub fn new(caption: impl Into<String>, left: usize, head: &[&str]) -> DocTable {
        let head = head.iter().map(|name| name.to_string()).collect();
        DocTable { caption: caption.into(), left, head, ..DocTable::default() }
    }

    /// Adds a row.
    pub fn row<C: Into<DocCell>>(&mut self, cells: impl IntoIterator<Item = C>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// The table as text.
    pub fn text(&self) -> String {
        let head: Vec<&str> = self.head.iter().map(String::as_str).collect();
        let mut rows = table(&head);
        let most = if self.most == 0 { usize::MAX } else { self.most };
        for row in self.rows.iter().take(most) {
            rows.add_row(row.iter().map(|cell| cell.text.clone()));
        }
        let body = finish(if self.wide { rows } else { narrow(rows, PAGE_WIDTH) }, self.left);
        let more = match self.rows.len().saturating_sub(most) {
            0 => String::new(),
            more => format!("and {more} more in report.html\n"),
        };
        lines(&self.caption) + &body + &more
    }

    fn html(&self) -> String {
        let class = format!("numbers {}", self.class);
        let mut text = format!("<div class=\"scroll\"><table class=\"{}\">", class.trim());
        if !self.caption.is_empty() && self.folded.is_empty() {
            text += &format!("<caption>{}</caption>", escaped(&self.caption));
        }
        let head = |(i, name): (usize, &String)| {
            DocCell::from(name.trim().replace('\n', " ")).html("th", i < self.left)
        };
        text += &format!(
            "<thead><tr>{}</tr></thead><tbody>\n",
            self.head.iter().enumerate().map(head).collect::<String>()
        );
        for row in &self.rows {
            let cell = |(i, c): (usize, &DocCell)| c.html(if i == 0 { "th" } else { "td" }, i < self.left);
            text += &format!("<tr>{}</tr>\n", row.iter().enumerate().map(cell).collect::<String>());
        }
        text += "</tbody></table></div>\n";
        match self.folded.as_str() {
            "" => text,
            words => format!("<details><summary>{}</summary>\n{text}</details>\n", escaped(words)),
        }
    }
}

/// A part of a document.
#[derive(Clone, Debug)]
pub enum DocBlock {
    /// Name of a part, with a remark; scenes are anchors.
    Heading(String, String),
    /// A paragraph. Line breaks stay.
    Text(Tone, String),
    /// Sentences, each with the words that it is about.
    Points(Vec<[String; 2]>),
    /// A table.
    Table(DocTable),
    /// Charts in a grid of this CSS class; pages only.
    Charts(&'static str, Vec<Chart>),
    /// Anything else; pages only.
    Html(String),
}

/// The document as text, in lines of at most 120 characters except for wide tables.
pub fn text(blocks: &[DocBlock]) -> String {
    let one = |block: &DocBlock| match block {
        DocBlock::Heading(name, remark) if remark.is_empty() => format!("\n{name}\n"),
        DocBlock::Heading(name, remark) => format!("\n{name} · {remark}\n"),
        DocBlock::Text(_, text) if text.is_empty() => String::new(),
        DocBlock::Text(Tone::Lead, text) => lines(text) + "\n",
        DocBlock::Text(Tone::Soft, text) => format!("\n{}", lines(text)),
        DocBlock::Text(_, text) => lines(text),
        DocBlock::Points(points) => {
            points.iter().map(|[about, words]| lines(&format!("{about}: {words}"))).collect::<String>() + "\n"
        }
        DocBlock::Table(table) if table.rows.is_empty() || table.page_only => String::new(),
        DocBlock::Table(table) => format!("\n{}", table.text()),
        DocBlock::Charts(..) | DocBlock::Html(_) => String::new(),
    };
    blocks.iter().map(one).collect()
}

/// The lines of a text, each wrapped to [`PAGE_WIDTH`].
pub fn lines(text: &str) -> String {
    let whole = text.lines().flat_map(|line| match line.trim().is_empty() {
        true => vec![String::new()],
        false => wrapped(line, PAGE_WIDTH),
    });
    whole.map(|line| line + "\n").collect()
}

/// A text as HTML; what stands between backquotes is code.
fn marked(text: &str) -> String {
    let lines: Vec<String> = text.trim().lines().map(escaped).collect();
    let safe = lines.join("<br/>\n");
    let part = |(i, part): (usize, &str)| match i % 2 {
        0 => part.to_string(),
        _ => format!("<code>{part}</code>"),
    };
    safe.split('`').enumerate().map(part).collect()
}

/// The document as HTML.
pub fn html(blocks: &[DocBlock]) -> String {
    let one = |block: &DocBlock| match block {
        DocBlock::Heading(name, remark) => {
            let (id, name, remark) = (anchor(name), escaped(name), escaped(remark));
            format!("<h3 id=\"{id}\">{name} <span class=\"soft\">{remark}</span></h3>\n")
        }
        DocBlock::Text(_, text) if text.trim().is_empty() => String::new(),
        DocBlock::Text(tone, text) => format!("<p class=\"{}\">{}</p>\n", tone.class(), marked(text)),
        DocBlock::Points(points) => {
            let point = |[about, words]: &[String; 2]| {
                format!("<dt>{}</dt><dd>{}</dd>\n", escaped(about), marked(words))
            };
            format!("<dl>\n{}</dl>\n", points.iter().map(point).collect::<String>())
        }
        DocBlock::Table(table) if table.rows.is_empty() => String::new(),
        DocBlock::Table(table) => table.html(),
        DocBlock::Charts(class, charts) => {
            let charts: String = charts.iter().map(Chart::svg).collect();
            format!("<div class=\"panels {class}\">\n{charts}</div>\n")
        }
        DocBlock::Html(html) => html.clone(),
    };
    blocks.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_reads_the_same_in_a_terminal_and_on_a_page() {
        let mut table = DocTable::new("caption", 1, &["solver", "time\nµs"]);
        table.row([DocCell::solver("pgs"), "12.3".into()]);
        table.row([DocCell::scene("a<b"), DocCell::from("fell").tone(Tone::Bad)]);
        table.most = 1;
        let blocks = [DocBlock::Text(Tone::Bad, "x & y ".repeat(30)), DocBlock::Table(table)];
        let terminal = text(&blocks);
        assert!(terminal.lines().all(|line| line.chars().count() <= PAGE_WIDTH), "{terminal}");
        assert!(terminal.contains("pgs") && terminal.contains("and 1 more in report.html"), "{terminal}");
        let page = html(&blocks);
        for part in [
            "x &amp; y",
            "<caption>caption",
            "a&lt;b</a>",
            "class=\"bad\">fell",
            "href=\"#scene-a-b\"",
            "time µs",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
}
