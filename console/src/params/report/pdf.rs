//! The report as PDF, A4, in the fonts that every reader has.

use params::acceptance::{Block, document::Table, limits::Envelope};
use pdf_writer::{Content, Finish as _, Name, Pdf, Rect, Ref, Str};

use super::plot;

const WIDTH: f32 = 595.0;
const HEIGHT: f32 = 842.0;
const MARGIN: f32 = 42.0;
const INNER: f32 = WIDTH - 2.0 * MARGIN;
const PLAIN: Name<'static> = Name(b"F1");
const BOLD: Name<'static> = Name(b"F2");

/// Widths of Helvetica, 1/1000 of the size, from space to tilde (Adobe's metrics).
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278,
    500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469,
    556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500,
    278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

/// The whole file.
pub fn file(blocks: &[Block]) -> Vec<u8> {
    let mut paper = Paper::new();
    for block in blocks {
        paper.block(block);
    }
    paper.finish()
}

/// Pages under construction; `y` falls from the top.
struct Paper {
    done: Vec<Content>,
    page: Content,
    y: f32,
    empty: bool,
}

impl Paper {
    fn new() -> Self {
        Self { done: Vec::new(), page: Content::new(), y: HEIGHT - MARGIN, empty: true }
    }

    fn turn(&mut self) {
        self.done.push(std::mem::replace(&mut self.page, Content::new()));
        self.y = HEIGHT - MARGIN;
        self.empty = true;
    }

    /// Turns the page unless `height` still fits.
    fn room(&mut self, height: f32) {
        if self.y - height < MARGIN + 14.0 {
            self.turn();
        }
    }

    fn block(&mut self, block: &Block) {
        match block {
            Block::Title(text) => {
                if !self.empty {
                    self.turn();
                }
                self.paragraph(text, 20.0, BOLD, 10.0);
            }
            Block::Heading(text) => {
                self.room(80.0);
                self.y -= 8.0;
                self.paragraph(text, 13.0, BOLD, 4.0);
            }
            Block::Part(text) => {
                self.room(60.0);
                self.paragraph(text, 10.5, BOLD, 2.0);
            }
            Block::Text(text) => self.paragraph(text, 9.5, PLAIN, 5.0),
            Block::Ticks(lines) => lines.iter().for_each(|line| self.tick(line)),
            Block::Form(lines) => lines.iter().for_each(|line| self.place(line)),
            Block::Table(table) => self.table(table),
            Block::Limit(limit) => self.limit(limit),
        }
    }

    fn text(&mut self, x: f32, y: f32, size: f32, font: Name<'_>, text: &str) {
        self.empty = false;
        self.page.begin_text().set_font(font, size).next_line(x, y).show(Str(&encoded(text))).end_text();
    }

    fn paragraph(&mut self, text: &str, size: f32, font: Name<'_>, after: f32) {
        for line in wrapped(text, size, INNER) {
            self.room(size * 1.35);
            self.y -= size * 1.35;
            self.text(MARGIN, self.y, size, font, &line);
        }
        self.y -= after;
    }

    fn tick(&mut self, text: &str) {
        for (at, line) in wrapped(text, 9.5, INNER - 16.0).iter().enumerate() {
            self.room(15.0);
            self.y -= 13.5;
            if at == 0 {
                self.page.set_line_width(0.8).rect(MARGIN, self.y - 1.0, 8.5, 8.5).stroke();
            }
            self.text(MARGIN + 16.0, self.y, 9.5, PLAIN, line);
        }
        self.y -= 3.0;
    }

    fn place(&mut self, text: &str) {
        self.room(30.0);
        self.y -= 26.0;
        self.text(MARGIN, self.y, 9.5, PLAIN, text);
        self.rule(MARGIN + 200.0, WIDTH - MARGIN, self.y - 2.0, 0.6);
        self.y -= 4.0;
    }

    fn rule(&mut self, from: f32, to: f32, y: f32, width: f32) {
        self.page.set_line_width(width).move_to(from, y).line_to(to, y).stroke();
    }

    fn table(&mut self, table: &Table) {
        let heads: Vec<String> = table.heads.iter().map(ToString::to_string).collect();
        self.room(50.0);
        self.row(&heads, &table.widths, BOLD);
        for row in &table.rows {
            let before = self.done.len();
            self.room(row_height(row, &table.widths));
            if self.done.len() > before {
                self.row(&heads, &table.widths, BOLD);
            }
            self.row(row, &table.widths, PLAIN);
        }
        self.y -= 8.0;
    }

    fn row(&mut self, cells: &[String], widths: &[u32], font: Name<'static>) {
        let height = row_height(cells, widths);
        let mut x = MARGIN;
        for (at, (cell, width)) in cells.iter().zip(widths).enumerate() {
            let width = INNER * *width as f32 / 100.0;
            let strong = at == 0 || ["FELL SHORT", "NOT PROVEN"].contains(&cell.as_str());
            let font = if strong { BOLD } else { font };
            if cell == "[ ]" {
                self.page.set_line_width(0.8).rect(x + 2.0, self.y - 11.0, 7.5, 7.5).stroke();
            } else {
                for (line, text) in wrapped(cell, CELL, width - 5.0).iter().enumerate() {
                    let y = self.y - 3.0 - CELL * 1.2 * (line + 1) as f32;
                    self.text(x + 1.0, y, CELL, font, text);
                }
            }
            x += width;
        }
        self.y -= height;
        self.page.set_stroke_gray(0.75);
        self.rule(MARGIN, WIDTH - MARGIN, self.y, 0.4);
        self.page.set_stroke_gray(0.0);
    }

    fn limit(&mut self, limit: &Envelope) {
        let (width, height) = (INNER - 60.0, 120.0);
        self.room(height + 50.0);
        self.paragraph(&limit.title, 8.5, PLAIN, 4.0);
        let (low, high, end) = plot::bounds(limit);
        let (left, bottom) = (MARGIN + 50.0, self.y - height);
        let at = |(ms, value): (f64, f64)| {
            let (x, y) = (ms / end, (value - low) / (high - low));
            (left + width * x as f32, bottom + height * y as f32)
        };
        let shape = limit.upper.iter().chain(limit.lower.iter().rev()).copied();
        self.page.set_fill_rgb(0.88, 0.95, 0.90);
        self.path(shape.map(at));
        self.page.close_path().fill_nonzero();
        self.page.set_fill_gray(0.0).set_stroke_rgb(0.18, 0.55, 0.34).set_line_width(1.4);
        for line in [&limit.upper, &limit.lower] {
            self.path(line.iter().copied().map(at));
            self.page.stroke();
        }
        self.page.set_stroke_gray(0.4).set_line_width(0.6).rect(left, bottom, width, height).stroke();
        self.page.set_stroke_gray(0.0);
        for value in labels(limit) {
            let (_, y) = at((0.0, value));
            let text = format!("{value:.0} {}", limit.unit);
            self.text(left - 4.0 - length(&text, 7.5), y - 2.5, 7.5, PLAIN, &text);
        }
        for part in [0.0, 0.5, 1.0] {
            let text = format!("{:.0} ms", end * part);
            let x = left + width * part as f32 - length(&text, 7.5) / 2.0;
            self.text(x, bottom - 10.0, 7.5, PLAIN, &text);
        }
        self.y = bottom - 22.0;
    }

    fn path(&mut self, points: impl Iterator<Item = (f32, f32)>) {
        for (at, (x, y)) in points.enumerate() {
            if at == 0 {
                self.page.move_to(x, y);
            } else {
                self.page.line_to(x, y);
            }
        }
    }

    fn finish(mut self) -> Vec<u8> {
        self.turn();
        let count = self.done.len() as i32;
        let (catalog, tree, plain, bold) = (Ref::new(1), Ref::new(2), Ref::new(3), Ref::new(4));
        let page = |at: i32| (Ref::new(10 + 2 * at), Ref::new(11 + 2 * at));
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(tree);
        pdf.pages(tree).kids((0..count).map(|at| page(at).0)).count(count);
        for (font, name) in [(plain, b"Helvetica".as_slice()), (bold, b"Helvetica-Bold".as_slice())] {
            pdf.type1_font(font).base_font(Name(name)).encoding_predefined(Name(b"WinAnsiEncoding"));
        }
        for (at, mut content) in (0..count).zip(self.done) {
            let text = format!("{} / {count}", at + 1);
            let x = WIDTH - MARGIN - length(&text, 8.0);
            content
                .begin_text()
                .set_font(PLAIN, 8.0)
                .next_line(x, 24.0)
                .show(Str(&encoded(&text)))
                .end_text();
            let (own, stream) = page(at);
            let mut object = pdf.page(own);
            object.media_box(Rect::new(0.0, 0.0, WIDTH, HEIGHT)).parent(tree).contents(stream);
            object.resources().fonts().pair(PLAIN, plain).pair(BOLD, bold);
            object.finish();
            pdf.stream(stream, &content.finish());
        }
        pdf.finish()
    }
}

/// Size of the text in tables.
const CELL: f32 = 7.8;

fn row_height(cells: &[String], widths: &[u32]) -> f32 {
    let lines = cells
        .iter()
        .zip(widths)
        .map(|(cell, width)| wrapped(cell, CELL, INNER * *width as f32 / 100.0 - 5.0).len());
    lines.max().unwrap_or(1).max(1) as f32 * CELL * 1.2 + 6.0
}

/// Values worth a label: the ends of both lines.
fn labels(limit: &Envelope) -> Vec<f64> {
    let ends = [limit.upper.first(), limit.upper.last(), limit.lower.last()];
    let (low, high, _) = plot::bounds(limit);
    let mut kept: Vec<f64> = Vec::new();
    for value in ends.into_iter().flatten().map(|(_, value)| *value) {
        // Two labels on one another cannot be read.
        if kept.iter().all(|known| (known - value).abs() > (high - low) * 0.08) {
            kept.push(value);
        }
    }
    kept
}

/// Windows-1252, as the fonts are encoded; what it has not becomes a question mark.
fn encoded(text: &str) -> Vec<u8> {
    text.chars()
        .map(|letter| match letter {
            ' '..='~' => letter as u8,
            '\u{a0}'..='\u{ff}' => letter as u32 as u8,
            '–' => 0x96,
            '—' => 0x97,
            '…' => 0x85,
            '≤' | '≥' | '→' => b'~',
            'Δ' => b'D',
            _ => b'?',
        })
        .collect()
}

fn length(text: &str, size: f32) -> f32 {
    let width = |letter: char| {
        let at = (letter as usize).wrapping_sub(0x20);
        f32::from(WIDTHS.get(at).copied().unwrap_or(556))
    };
    text.chars().map(width).sum::<f32>() * size / 1_000.0
}

/// Lines no longer than `width`; a word that is longer is broken. Bold is a little wider.
fn wrapped(text: &str, size: f32, width: f32) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let longer = if line.is_empty() { word.to_string() } else { format!("{line} {word}") };
        if length(&longer, size) * 1.07 <= width {
            line = longer;
            continue;
        }
        if !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        for letter in word.chars() {
            if length(&line, size) * 1.07 + size > width && !line.is_empty() {
                lines.push(std::mem::take(&mut line));
            }
            line.push(letter);
        }
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_report_becomes_several_pages_and_no_line_leaves_its_width() {
        let mut table = Table::new(&[("parameter", 20), ("meaning", 80)]);
        (0..200).for_each(|at| {
            table.row([&format!("Prm{at}"), "a text that goes on and on and on ".repeat(6).trim()]);
        });
        let file = file(&[Block::Title("Report".into()), Block::Table(table)]);
        assert!(file.starts_with(b"%PDF-"));
        let pages = file.windows(11).filter(|window| *window == b"/Type /Page").count();
        assert!(pages > 5, "{pages}");
        for line in wrapped("velocity_limit_positive_direction_without_any_space and more", 8.0, 60.0) {
            assert!(length(&line, 8.0) <= 60.0, "{line}");
        }
    }
}
