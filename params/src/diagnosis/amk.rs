//! AMK codes: a message, Info1 for the source, Info2 and Info3 for the detail.

use std::sync::LazyLock;

use serde::Deserialize;
use shm_schema::{catalogue, profile::Profile};

use super::{Explanation, Info, joined, text};

#[derive(Deserialize)]
struct Tables {
    message: Vec<Message>,
    code: Vec<Row>,
}

#[derive(Deserialize)]
struct Message {
    code: i64,
    name: String,
    cause: String,
    class: String,
}

#[derive(Deserialize)]
struct Row {
    code: i64,
    info1: i64,
    title: String,
    #[serde(default)]
    channel: String,
    #[serde(default)]
    info2: Vec<Meaning>,
    #[serde(default)]
    info3: Vec<Meaning>,
    #[serde(default)]
    params_to_check: String,
    reaction: String,
    remedy: String,
    ack: String,
    #[serde(default)]
    note: String,
    at: String,
}

/// A value of Info2 or Info3; `*` stands for any.
#[derive(Deserialize)]
struct Meaning {
    value: toml::Value,
    #[serde(rename = "meaning")]
    words: String,
    #[serde(default)]
    params: String,
    #[serde(default)]
    channel: String,
    #[serde(default)]
    for_info2: Option<i64>,
}

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    toml::from_str(catalogue::AMK_DIAGNOSIS)
        .expect("the catalogues are part of the build and checked by its tests")
});

/// Explains `3606`, `3606/13`, `3606/13/6` or `3606/13/6/0`.
pub(super) fn explain(code: &str) -> Vec<Explanation> {
    let fields: Option<Vec<i64>> = code.split('/').map(|field| field.trim().parse().ok()).collect();
    let Some(fields) = fields else {
        return Vec::new();
    };
    let wanted = |row: &&Row| row.code == fields[0] && fields.get(1).is_none_or(|info1| row.info1 == *info1);
    TABLES.code.iter().filter(wanted).map(|row| row.explanation(fields.get(2), fields.get(3))).collect()
}

pub(super) fn all() -> Vec<Explanation> {
    TABLES.code.iter().map(|row| row.explanation(None, None)).collect()
}

impl Row {
    fn explanation(&self, info2: Option<&i64>, info3: Option<&i64>) -> Explanation {
        let message = TABLES.message.iter().find(|message| message.code == self.code);
        let fields = [Some(self.code), Some(self.info1), info2.copied(), info3.copied()];
        let code: Vec<_> = fields.into_iter().flatten().map(|field| field.to_string()).collect();
        Explanation {
            profile: Profile::AmkKw.name().into(),
            code: code.join("/"),
            title: joined(&[message.map_or("", |message| &message.name), &self.title]),
            class: message.map_or(String::new(), |message| message.class.clone()),
            channel: self.channel.clone(),
            cause: message.map_or(String::new(), |message| message.cause.clone()),
            reaction: self.reaction.clone(),
            remedy: self.remedy.clone(),
            acknowledge: self.ack.clone(),
            params: self.params_to_check.clone(),
            infos: self.infos(info2, info3),
            source: joined(&[&self.at, &self.note]),
        }
    }

    /// The meaning of the fields that are given; without any, every meaning there is.
    fn infos(&self, info2: Option<&i64>, info3: Option<&i64>) -> Vec<Info> {
        let all = info2.is_none();
        let second = self.info2.iter().filter(|meaning| all || meaning.fits(info2));
        let second = second.map(|meaning| meaning.info("Info2", info2));
        let fits = |meaning: &&Meaning| {
            all || meaning.fits(info3) && meaning.for_info2.is_none_or(|value| Some(&value) == info2)
        };
        let third = self.info3.iter().filter(fits).map(|meaning| meaning.info("Info3", info3));
        let mut infos: Vec<Info> = second.chain(third).collect();
        for (field, value) in [("Info2", info2), ("Info3", info3)] {
            // 0 stands for an empty field (DEC-45).
            let Some(value) = value.filter(|value| **value != 0) else { continue };
            if infos.iter().all(|info| info.field != field) {
                infos.push(Info {
                    field: field.into(),
                    value: value.to_string(),
                    meaning: "the vendor's tables give this value no meaning".into(),
                    params: String::new(),
                });
            }
        }
        infos
    }
}

impl Meaning {
    fn fits(&self, value: Option<&i64>) -> bool {
        value.is_some_and(|value| self.value.as_integer().is_none_or(|own| own == *value))
    }

    fn info(&self, field: &str, value: Option<&i64>) -> Info {
        let value = value.map_or_else(|| text(&self.value), i64::to_string);
        let channel =
            if self.channel.is_empty() { String::new() } else { format!("channel {}", self.channel) };
        Info {
            field: field.into(),
            value,
            meaning: joined(&[&self.words, &channel]),
            params: self.params.clone(),
        }
    }
}
