//! The blocks of a report, in the order of the vendor's.

use super::{
    Acceptance, Outcome,
    document::{Block, Table},
};
use crate::{definition, image::Signatures, response, rule::Severity, view::Row};

/// What every installation assumes (design 3.4, 5; DEC-26).
const ASSUMPTIONS: [&str; 6] = [
    "The evaluator of the inhibit paths drops a path after three missing edges.",
    "One producer for both channels: freedom from interference between encoder signals is the builder's to show.",
    "All clocks of one PC hang on one crystal; the fieldbus master's watchdog is the independent witness.",
    "The axis is in STO and the danger zone clear while a set is loaded.",
    "Mechanical brakes, protection of vertical axes and the stopping of the drive are the builder's.",
    "Nothing here is certified; the assessment of the machine is its builder's.",
];

const SINGLE_CHECKS: [&str; 6] = [
    "Visual inspection of wiring and shielding",
    "Device type and serial number agree with the label",
    "Signatures agree with those that the running set reports",
    "Every value below agrees with the safety requirement it serves",
    "The axis was in STO and the danger zone clear while the set was loaded",
    "Behaviour was tested in every operating mode",
];

/// One undetected fault may cost the reaction one more exchange and the dead-man of the path,
/// which three missing edges drop (design 3.4, 8), ms at a cycle of 1 ms.
const ONE_FAULT_US: u64 = 4_000;

impl Acceptance {
    /// Everything that stands in the report.
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = vec![Block::Title(format!("Acceptance report, axis {}", self.axis))];
        self.identity(&mut blocks);
        self.verdict(&mut blocks);
        blocks.push(Block::Heading("Assumptions of use".into()));
        blocks.push(Block::Ticks(ASSUMPTIONS.map(str::to_string).into()));
        blocks.push(Block::Heading("Single checks".into()));
        blocks.push(Block::Ticks(SINGLE_CHECKS.map(str::to_string).into()));
        self.findings(&mut blocks);
        self.steps(&mut blocks);
        self.proofs(&mut blocks);
        self.responses(&mut blocks);
        self.limits(&mut blocks);
        self.values(&mut blocks);
        blocks.push(Block::Heading("Signatures".into()));
        blocks.push(Block::Form(
            ["Parameterised by", "Tested by", "Accepted by"]
                .iter()
                .map(|who| format!("{who} (name, date, signature)"))
                .collect(),
        ));
        blocks
    }

    fn identity(&self, blocks: &mut Vec<Block>) {
        let Signatures { template, content, device } = self.signatures;
        let mut table = Table::new(&[("identification", 30), ("", 70)]);
        table.row(["file", &self.file]);
        table.row(["profile", self.profile]);
        table.row(["serial number of the device", &self.serial]);
        table.row(["template signature", &format!("{template:08X}")]);
        table.row(["content signature", &format!("{content:08X}")]);
        table.row(["device signature", &format!("{device:08X}")]);
        table.row(["SRA CRC for an FSoE master", &format!("{:08X}", self.sra_crc)]);
        table.row(["made with", concat!("safepair ", env!("CARGO_PKG_VERSION"))]);
        blocks.push(Block::Table(table));
        blocks.push(Block::Form(
            ["Machine, customer, place", "Supplier, installer, labelling", "Date"].map(str::to_string).into(),
        ));
    }

    fn verdict(&self, blocks: &mut Vec<Block>) {
        let done: Vec<bool> = self.steps.iter().filter_map(Outcome::passed).collect();
        let text = if done.is_empty() {
            "The steps below were not run: fill in what was measured.".to_string()
        } else {
            let short = done.iter().filter(|passed| !**passed).count();
            let run =
                "on the simulated axis, in virtual time, with the real cores of both channels and crosscheck";
            if short == 0 {
                format!("Acceptance run {run}: all {} steps passed.{}", done.len(), self.open())
            } else {
                format!("Acceptance run {run}: {short} of {} steps FELL SHORT.{}", done.len(), self.open())
            }
        };
        blocks.push(Block::Text(text));
    }

    /// What the run did not prove, in one sentence; empty: nothing.
    fn open(&self) -> String {
        let names: Vec<_> = self.unproven.iter().map(|open| open.function.as_str()).collect();
        if names.is_empty() { String::new() } else { format!(" NOT PROVEN: {}.", names.join(", ")) }
    }

    fn findings(&self, blocks: &mut Vec<Block>) {
        blocks.push(Block::Heading("Findings of the plausibility check".into()));
        if self.findings.is_empty() {
            blocks.push(Block::Text("None.".into()));
            return;
        }
        let mut table =
            Table::new(&[("weight", 10), ("rule", 16), ("code", 14), ("what", 35), ("remedy", 25)]);
        for finding in &self.findings {
            let weight = if finding.severity == Severity::Error { "error" } else { "warning" };
            table.row([weight, &finding.rule, &finding.code, &finding.message, &finding.remedy]);
        }
        blocks.push(Block::Table(table));
    }

    fn steps(&self, blocks: &mut Vec<Block>) {
        blocks.push(Block::Heading("Test steps".into()));
        let mut table = Table::new(&[
            ("function", 10),
            ("what is done", 20),
            ("expected", 23),
            ("when", 14),
            ("measured", 22),
            ("verdict", 11),
        ]);
        for step in &self.steps {
            for (at, expectation) in step.trial.expectations.iter().enumerate() {
                let first = |text: &str| if at == 0 { text.to_string() } else { String::new() };
                let measured = step.measured.get(at);
                let (text, verdict) = measured.map_or((String::new(), String::new()), |measured| {
                    (shown(measured), if measured.right { "passed" } else { "FELL SHORT" }.to_string())
                });
                table.row([
                    &first(&step.trial.function),
                    &first(&step.trial.action),
                    &expectation.what,
                    &expectation.when(),
                    &text,
                    &verdict,
                ]);
            }
        }
        for open in &self.unproven {
            table.row([&open.function, "no step", open.reason, "", "", "NOT PROVEN"]);
        }
        blocks.push(Block::Table(table));
    }

    fn proofs(&self, blocks: &mut Vec<Block>) {
        blocks.push(Block::Heading("Proofs at the machine".into()));
        blocks.push(Block::Text(
            "To be done with the real axis, in every operating mode; the simulated run above does not replace them.".into(),
        ));
        let mut table = Table::new(&[
            ("function", 15),
            ("test", 27),
            ("expected", 28),
            ("measured", 15),
            ("date, name", 15),
        ]);
        for proof in &self.proofs {
            table.row([&proof.function, &proof.test, &proof.expected, "", ""]);
        }
        blocks.push(Block::Table(table));
    }

    fn responses(&self, blocks: &mut Vec<Block>) {
        blocks.push(Block::Heading("Response times".into()));
        if self.responses.is_empty() {
            blocks.push(Block::Text(
                "The profile defines no chains; the reaction of the monitors is one cycle.".into(),
            ));
            return;
        }
        blocks.push(Block::Text(format!(
            "With one undetected fault add {} ms: one exchange more, and three missing edges until the evaluator drops the path.",
            response::ms(ONE_FAULT_US)
        )));
        let mut table = Table::new(&[
            ("chain", 26),
            ("parts, ms", 34),
            ("sum, ms", 10),
            ("with one fault, ms", 12),
            ("source", 18),
        ]);
        for chain in &self.responses {
            let parts: Vec<_> =
                chain.terms.iter().map(|term| format!("{} {}", term.name, response::ms(term.us))).collect();
            table.row([
                &chain.name,
                &parts.join(" + "),
                &response::ms(chain.total_us),
                &response::ms(chain.total_us.saturating_add(ONE_FAULT_US)),
                &chain.source,
            ]);
        }
        blocks.push(Block::Table(table));
    }

    fn limits(&self, blocks: &mut Vec<Block>) {
        if self.limits.is_empty() {
            return;
        }
        blocks.push(Block::Heading("Ramps and limits".into()));
        blocks.push(Block::Text(
            "What is permitted after a request at time 0, from the highest permitted speed (DEC-02 to DEC-06).".into(),
        ));
        blocks.extend(self.limits.iter().cloned().map(Block::Limit));
    }

    fn values(&self, blocks: &mut Vec<Block>) {
        blocks.push(Block::Heading("Values".into()));
        for (function, rows) in &self.values {
            let title = if function.is_empty() { "other" } else { function };
            blocks.push(Block::Part(title.into()));
            let mut table = Table::new(&[
                ("parameter", 14),
                ("name", 24),
                ("value", 13),
                ("unit", 8),
                ("range, default", 19),
                ("source", 13),
                ("checked", 9),
            ]);
            for row in rows {
                let (range, source) = self.defined(row);
                let value = if row.meaning.is_empty() || row.value.contains(&row.meaning) {
                    row.value.clone()
                } else {
                    format!("{} ({})", row.value, row.meaning)
                };
                table.row([&row.key, &row.name, &value, &row.unit, &range, &source, "[ ]"]);
            }
            blocks.push(Block::Table(table));
        }
    }

    fn defined(&self, row: &Row) -> (String, String) {
        let profile = definition::profile_by_name(self.profile);
        let found = profile.and_then(|profile| definition::by_number(profile, row.number));
        found.map_or((String::new(), String::new()), |found| {
            (format!("{}; default {}", found.range(), found.written(found.default)), found.source.clone())
        })
    }
}

fn shown(measured: &super::Measured) -> String {
    let mut parts = Vec::new();
    if let Some(ms) = measured.t_ms {
        parts.push(format!("{ms:.0} ms"));
    }
    if let Some(rpm) = measured.rpm {
        parts.push(format!("{rpm:.1} rpm"));
    }
    if !measured.text.is_empty() {
        parts.push(measured.text.clone());
    }
    parts.join(", ")
}
