//! GPIO chips and the lines of the inhibit paths.

use gpiocdev::chip::{Chip, chips};

use super::{Finding, Judgement};

const FIX: &str = "the driver of the chip; udev/70-safepair.rules; name the line with --line CHIP:LINE";

/// Every chip, and each line asked for.
pub fn judge(lines: &[String]) -> Vec<Finding> {
    let found = chips().unwrap_or_default();
    let mut findings: Vec<Finding> = found.iter().map(|path| chip(path)).collect();
    if findings.is_empty() {
        let needed = if lines.is_empty() { Judgement::Note } else { Judgement::Short };
        findings.push(Finding::new(needed, "no GPIO chip", "a chip, where a path is a line", FIX));
    }
    findings.extend(lines.iter().map(|line| one(line)));
    findings
}

fn chip(path: &std::path::Path) -> Finding {
    match Chip::from_path(path).and_then(|chip| chip.info()) {
        Ok(info) => Finding::new(
            Judgement::Fit,
            format!("{}: {:?}, {} lines", path.display(), info.label, info.num_lines),
            "readable",
            FIX,
        ),
        Err(error) => Finding::new(Judgement::Short, format!("{}: {error}", path.display()), "readable", FIX),
    }
}

fn one(line: &str) -> Finding {
    let expected = "a free line of a chip";
    let (judgement, read) = match look(line) {
        Ok(None) => (Judgement::Fit, format!("{line}: free")),
        Ok(Some(owner)) => (Judgement::Short, format!("{line}: in use by {owner:?}")),
        Err(error) => (Judgement::Short, format!("{line}: {error}")),
    };
    Finding::new(judgement, read, expected, FIX)
}

/// Who holds the line.
fn look(line: &str) -> Result<Option<String>, String> {
    let (chip, offset) = line.rsplit_once(':').ok_or("expected CHIP:LINE")?;
    let offset = offset.parse().map_err(|_| "expected a number behind the colon")?;
    let path = if chip.contains('/') { chip.to_owned() } else { format!("/dev/{chip}") };
    let info = Chip::from_path(&path).and_then(|chip| chip.line_info(offset));
    let info = info.map_err(|error| error.to_string())?;
    Ok(info.used.then_some(info.consumer))
}
