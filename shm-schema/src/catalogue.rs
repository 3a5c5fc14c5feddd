//! The catalogues and fact tables as text, for tools that explain, trace and check.
//!
//! Only with feature `catalogue`, which no core enables: a channel reads the generated
//! constants of [`crate::facts`] and nothing else.

/// AMK: functions, inputs and outputs, words, start-up, timing (ids `AMK-…`).
pub const AMK_FUNCTIONS: &str = include_str!("../catalogue/amk-functions.toml");
/// AMK: parameters, plausibility rows, diagnosis (ids `AMKP-…`).
pub const AMK_DIAGNOSIS: &str = include_str!("../catalogue/amk-parameters-diagnosis.toml");
/// Lenze SM301 (ids `LNZ-…`).
pub const LENZE: &str = include_str!("../catalogue/lenze-sm301.toml");
/// Schneider ATV340 with VW3A3807 (ids `ATV-…`).
pub const ATV: &str = include_str!("../catalogue/schneider-atv340.toml");
/// ETG.6100.2 (ids `ETG-…`).
pub const ETG: &str = include_str!("../catalogue/etg-6100-2.toml");
/// The decisions (ids `DEC-…`).
pub const DECISIONS: &str = include_str!("../catalogue/decisions.md");

/// Parameters of `amk-kw`.
pub const PARAMETERS_AMK_KW: &str = include_str!("../facts/parameters-amk-kw.toml");
/// Parameters of `lenze-sm301`.
pub const PARAMETERS_LENZE_SM301: &str = include_str!("../facts/parameters-lenze-sm301.toml");
/// Parameters of `atv340`.
pub const PARAMETERS_ATV340: &str = include_str!("../facts/parameters-atv340.toml");
/// Parameters of `etg-6100-2`.
pub const PARAMETERS_ETG_6100_2: &str = include_str!("../facts/parameters-etg-6100-2.toml");
/// Parameters of `[common]`.
pub const PARAMETERS_COMMON: &str = include_str!("../facts/parameters-common.toml");
/// Functions and objects of the generic profile.
pub const ETG_OBJECTS: &str = include_str!("../facts/etg-objects.toml");
/// Plausibility rows and advice of `amk-kw`.
pub const RULES_AMK_KW: &str = include_str!("../facts/rules-amk-kw.toml");
/// Plausibility and advice of `lenze-sm301`.
pub const RULES_LENZE_SM301: &str = include_str!("../facts/rules-lenze-sm301.toml");
/// Conditions and advice of `atv340`.
pub const RULES_ATV340: &str = include_str!("../facts/rules-atv340.toml");
/// Control and status word of `etg-6100-2`.
pub const WORDS_ETG_6100_2: &str = include_str!("../facts/words-etg-6100-2.toml");
/// What has to be proved at the machine, function by function.
pub const PROOFS: &str = include_str!("../facts/proofs.toml");
