//! The report as one HTML file: nothing is loaded from anywhere, ready to print on A4.

use std::fmt::Write as _;

use params::acceptance::{Block, document::Table};

use super::plot;

const STYLE: &str = "
:root { --ink: #1c2530; --soft: #5b6775; --line: #d5dbe2; --good: #1d7a46; --bad: #b3261e; }
* { box-sizing: border-box; }
body { font: 14px/1.45 system-ui, 'Segoe UI', 'Liberation Sans', Arial, sans-serif; color: var(--ink);
  max-width: 62rem; margin: 0 auto; padding: 2rem 1.5rem 4rem; }
h1 { font-size: 1.9rem; margin: 0 0 1rem; padding-bottom: .5rem; border-bottom: 3px solid var(--ink); }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; padding-bottom: .2rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; color: var(--soft); }
table { width: 100%; border-collapse: collapse; table-layout: fixed; margin: .4rem 0 1rem; }
th { text-align: left; font-weight: 600; font-size: .82rem; color: var(--soft); border-bottom: 2px solid var(--line); }
td, th { padding: .32rem .5rem; vertical-align: top; overflow-wrap: anywhere; }
td { border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; }
tr.group td { border-top: 2px solid #9aa5b1; }
td:first-child { font-weight: 600; }
.passed { color: var(--good); font-weight: 600; } .short { color: var(--bad); font-weight: 700; }
.result { font-size: 1.05rem; padding: .7rem 1rem; border-left: 5px solid var(--soft); background: #f4f6f8; }
.result.good { border-color: var(--good); } .result.bad { border-color: var(--bad); }
ul.ticks { list-style: none; padding: 0; } ul.ticks li { padding: .25rem 0 .25rem 1.9rem; position: relative; }
.box { display: inline-block; width: .95rem; height: .95rem; border: 1.5px solid var(--soft); border-radius: 2px; }
ul.ticks .box { position: absolute; left: 0; top: .4rem; }
.form { display: grid; grid-template-columns: 16rem 1fr; gap: 1.1rem 1rem; margin: 1rem 0 1.5rem; align-items: end; }
.form span { color: var(--soft); } .form i { border-bottom: 1px solid var(--ink); height: 1.6rem; }
figure { margin: 0 0 1.2rem; break-inside: avoid; } figcaption { font-size: .9rem; color: var(--soft); margin-bottom: .3rem; }
figure svg { width: 100%; max-width: 640px; height: auto; border: 1px solid var(--line); border-radius: 4px; }
@page { size: A4; margin: 16mm 14mm 18mm; @bottom-right { content: counter(page) ' / ' counter(pages); font-size: 9pt; } }
@media print { body { max-width: none; padding: 0; font-size: 10pt; } h1 { break-before: page; } h1:first-of-type { break-before: auto; }
  h2, h3 { break-after: avoid; } tr { break-inside: avoid; } thead { display: table-header-group; } }
";

/// The whole page.
pub fn page(blocks: &[Block]) -> String {
    let title = blocks
        .iter()
        .find_map(|block| if let Block::Title(text) = block { Some(text.as_str()) } else { None });
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n",
        escaped(title.unwrap_or("Acceptance report"))
    );
    blocks.iter().for_each(|block| out.push_str(&element(block)));
    out.push_str("</body>\n</html>\n");
    out
}

fn element(block: &Block) -> String {
    match block {
        Block::Title(text) => format!("<h1>{}</h1>\n", escaped(text)),
        Block::Heading(text) => format!("<h2>{}</h2>\n", escaped(text)),
        Block::Part(text) => format!("<h3>{}</h3>\n", escaped(text)),
        Block::Text(text) => format!("<p{}>{}</p>\n", result(text), escaped(text)),
        Block::Ticks(lines) => {
            let items =
                lines.iter().map(|line| format!("<li><span class=\"box\"></span>{}</li>\n", escaped(line)));
            format!("<ul class=\"ticks\">\n{}</ul>\n", items.collect::<String>())
        }
        Block::Form(lines) => {
            let items = lines.iter().map(|line| format!("<span>{}</span><i></i>\n", escaped(line)));
            format!("<div class=\"form\">\n{}</div>\n", items.collect::<String>())
        }
        Block::Limit(limit) => {
            format!(
                "<figure><figcaption>{}</figcaption>{}</figure>\n",
                escaped(&limit.title),
                plot::svg(limit)
            )
        }
        Block::Table(table) => rows(table),
    }
}

/// The sentence that a reader looks for first.
fn result(text: &str) -> &'static str {
    match text {
        _ if text.contains("FELL SHORT") || text.contains("NOT PROVEN") => " class=\"result bad\"",
        _ if text.contains("steps passed") => " class=\"result good\"",
        _ if text.contains("were not run") => " class=\"result\"",
        _ => "",
    }
}

fn rows(table: &Table) -> String {
    let mut out = String::from("<table>\n<colgroup>");
    table.widths.iter().for_each(|width| {
        let _ = write!(out, "<col style=\"width:{width}%\">");
    });
    out.push_str("</colgroup>\n<thead><tr>");
    table.heads.iter().for_each(|head| {
        let _ = write!(out, "<th>{}</th>", escaped(head));
    });
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        // A step has several lines; the first begins the group.
        let begins = table.heads.contains(&"verdict") && row.first().is_some_and(|cell| !cell.is_empty());
        out.push_str(if begins { "<tr class=\"group\">" } else { "<tr>" });
        row.iter().for_each(|cell| out.push_str(&cell_of(cell)));
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table>\n");
    out
}

fn cell_of(cell: &str) -> String {
    match cell {
        "passed" => "<td class=\"passed\">passed</td>".into(),
        "FELL SHORT" | "NOT PROVEN" => format!("<td class=\"short\">{cell}</td>"),
        "[ ]" => "<td><span class=\"box\"></span></td>".into(),
        text => format!("<td>{}</td>", escaped(text)),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_everything_and_loads_nothing() {
        let mut table = Table::new(&[("function", 50), ("verdict", 50)]);
        table.row(["<SLS1>", "passed"]).row(["", "FELL SHORT"]);
        let page = page(&[Block::Title("a & b".into()), Block::Table(table)]);
        for part in ["<h1>a &amp; b</h1>", "&lt;SLS1&gt;", "class=\"passed\"", "class=\"short\"", "@page"] {
            assert!(page.contains(part), "{part} is missing");
        }
        for loaded in ["src=", "href=", "http", "@import", "url("] {
            assert!(!page.contains(loaded), "{loaded} would be loaded");
        }
    }
}
