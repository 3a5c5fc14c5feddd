//! The report as blocks that every form (HTML, PDF, Markdown) renders alike.

use serde::Serialize;

use super::limits::Envelope;

/// One block.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "lowercase", tag = "block", content = "content")]
pub enum Block {
    /// Title of a report; each begins a page.
    Title(String),
    /// Heading.
    Heading(String),
    /// Heading of a part.
    Part(String),
    /// Paragraph.
    Text(String),
    /// Things to tick off.
    Ticks(Vec<String>),
    /// Table.
    Table(Table),
    /// Picture of a limit.
    Limit(Envelope),
    /// Places for handwriting.
    Form(Vec<String>),
}

/// A table.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// Heads.
    pub heads: Vec<&'static str>,
    /// Width of each column in per cent.
    pub widths: Vec<u32>,
    /// Cells, as many in each row as there are heads.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new(columns: &[(&'static str, u32)]) -> Self {
        Self {
            heads: columns.iter().map(|(head, _)| *head).collect(),
            widths: columns.iter().map(|(_, width)| *width).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn row<const N: usize>(&mut self, cells: [&str; N]) -> &mut Self {
        self.rows.push(cells.into_iter().map(str::to_string).collect());
        self
    }
}

/// The blocks as Markdown; limits as the points of their lines.
pub fn markdown(blocks: &[Block]) -> String {
    blocks.iter().map(part).collect::<Vec<_>>().join("\n")
}

fn part(block: &Block) -> String {
    match block {
        Block::Title(text) => format!("# {text}\n"),
        Block::Heading(text) => format!("## {text}\n"),
        Block::Part(text) => format!("### {text}\n"),
        Block::Text(text) => format!("{text}\n"),
        Block::Ticks(lines) => lines.iter().map(|line| format!("- [ ] {line}\n")).collect(),
        Block::Form(lines) => {
            lines.iter().map(|line| format!("- {line}: ______________________\n")).collect()
        }
        Block::Limit(limit) => format!(
            "{}\n\n- highest: {}\n- lowest: {}\n",
            limit.title,
            points(&limit.upper, limit.unit),
            points(&limit.lower, limit.unit)
        ),
        Block::Table(table) => {
            let line = |cells: &[String]| {
                let cells: Vec<_> =
                    cells.iter().map(|cell| cell.replace('|', "/").replace('\n', " ")).collect();
                format!("| {} |\n", cells.join(" | "))
            };
            let heads: Vec<String> = table.heads.iter().map(ToString::to_string).collect();
            let rule = format!("|{}\n", "---|".repeat(heads.len()));
            let rows: String = table.rows.iter().map(|row| line(row)).collect();
            format!("{}{rule}{rows}", line(&heads))
        }
    }
}

fn points(line: &[(f64, f64)], unit: &str) -> String {
    let points: Vec<_> = line.iter().map(|(ms, value)| format!("{ms:.0} ms {value:.1} {unit}")).collect();
    points.join(", ")
}
