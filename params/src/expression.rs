//! Conditions of the rule tables: whole numbers, names, `+ * %`, comparisons, `in`, `and`, `or`.
//!
//! ```text
//! or         = and { "or" and }
//! and        = comparison { "and" comparison }
//! comparison = sum [ ("==" | "!=" | "<" | ">" | "<=" | ">=") sum | ["not"] "in" "[" numbers "]" ]
//! sum        = product { "+" product }
//! product    = atom { ("*" | "%") atom }
//! atom       = number | name | "(" or ")"
//! ```
//!
//! A truth value is 1 or 0. There is no division: every rule can be written without.

use std::collections::BTreeSet;

/// A condition, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Expression {
    root: Node,
}

#[derive(Clone, Debug)]
enum Node {
    Number(i128),
    Name(String),
    Apply(Operator, Box<Node>, Box<Node>),
    In(Box<Node>, Vec<i128>, bool),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Or,
    And,
    Equal,
    Unequal,
    Below,
    Above,
    AtMost,
    AtLeast,
    Plus,
    Times,
    Modulo,
}

/// Every level of the grammar with its operators, loosest first.
const LEVELS: [&[(&str, Operator)]; 5] = [
    &[("or", Operator::Or)],
    &[("and", Operator::And)],
    &[
        ("==", Operator::Equal),
        ("!=", Operator::Unequal),
        ("<=", Operator::AtMost),
        (">=", Operator::AtLeast),
        ("<", Operator::Below),
        (">", Operator::Above),
    ],
    &[("+", Operator::Plus)],
    &[("*", Operator::Times), ("%", Operator::Modulo)],
];

/// The level on which `in` may stand.
const COMPARISON: usize = 2;

impl Expression {
    /// Reads a condition.
    ///
    /// # Errors
    /// What was expected and what stood there.
    pub fn parse(text: &str) -> Result<Self, String> {
        let tokens = tokens(text);
        let mut parser = Parser { tokens: &tokens, at: 0 };
        let root = parser.level(0)?;
        match parser.peek() {
            None => Ok(Self { root }),
            Some(rest) => Err(format!("the end of the condition, not {rest}")),
        }
    }

    /// Whether the condition holds. A name that `value` does not know makes it `None`.
    pub fn holds(&self, value: &dyn Fn(&str) -> Option<i128>) -> Option<bool> {
        evaluate(&self.root, value).map(|result| result != 0)
    }

    /// Every name in it.
    pub fn names(&self) -> BTreeSet<&str> {
        let mut names = BTreeSet::new();
        collect(&self.root, &mut names);
        names
    }
}

fn collect<'a>(node: &'a Node, names: &mut BTreeSet<&'a str>) {
    match node {
        Node::Number(_) => {}
        Node::Name(name) => {
            names.insert(name);
        }
        Node::In(inner, ..) => collect(inner, names),
        Node::Apply(_, left, right) => {
            collect(left, names);
            collect(right, names);
        }
    }
}

fn evaluate(node: &Node, value: &dyn Fn(&str) -> Option<i128>) -> Option<i128> {
    match node {
        Node::Number(number) => Some(*number),
        Node::Name(name) => value(name),
        Node::In(inner, list, wanted) => {
            let inner = evaluate(inner, value)?;
            Some(i128::from(list.contains(&inner) == *wanted))
        }
        Node::Apply(operator, left, right) => {
            apply(*operator, evaluate(left, value)?, evaluate(right, value)?)
        }
    }
}

fn apply(operator: Operator, left: i128, right: i128) -> Option<i128> {
    let truth = |truth: bool| Some(i128::from(truth));
    match operator {
        Operator::Or => truth(left != 0 || right != 0),
        Operator::And => truth(left != 0 && right != 0),
        Operator::Equal => truth(left == right),
        Operator::Unequal => truth(left != right),
        Operator::Below => truth(left < right),
        Operator::Above => truth(left > right),
        Operator::AtMost => truth(left <= right),
        Operator::AtLeast => truth(left >= right),
        Operator::Plus => Some(left.saturating_add(right)),
        Operator::Times => Some(left.saturating_mul(right)),
        Operator::Modulo => left.checked_rem_euclid(right),
    }
}

/// Words, numbers and signs of a condition.
fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let word = rest.find(|letter: char| !is_word(letter)).unwrap_or(rest.len());
        let double = ["==", "!=", "<=", ">="].iter().any(|sign| rest.starts_with(sign));
        let first = rest.chars().next().map_or(1, char::len_utf8);
        let length = if word > 0 { word } else { first + usize::from(double) };
        let (token, after) = rest.split_at(length);
        tokens.push(token);
        rest = after.trim_start();
    }
    tokens
}

/// Names such as `Prm67`, `C15030/1`, and numbers with their sign.
fn is_word(letter: char) -> bool {
    letter.is_alphanumeric() || ['_', '/', '.', '-'].contains(&letter)
}

struct Parser<'a> {
    tokens: &'a [&'a str],
    at: usize,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Option<&'a str> {
        self.tokens.get(self.at).copied()
    }

    fn next(&mut self) -> Option<&'a str> {
        let token = self.peek();
        self.at += 1;
        token
    }

    fn take(&mut self, wanted: &str) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += usize::from(found);
        found
    }

    fn level(&mut self, level: usize) -> Result<Node, String> {
        let Some(operators) = LEVELS.get(level) else {
            return self.atom();
        };
        let mut node = self.level(level + 1)?;
        if level == COMPARISON {
            node = self.membership(node)?;
        }
        while let Some((_, operator)) = operators.iter().find(|(sign, _)| self.peek() == Some(sign)) {
            self.at += 1;
            let right = self.level(level + 1)?;
            node = Node::Apply(*operator, Box::new(node), Box::new(right));
        }
        Ok(node)
    }

    fn membership(&mut self, node: Node) -> Result<Node, String> {
        let wanted = !self.take("not");
        if !self.take("in") {
            return if wanted { Ok(node) } else { Err("in after not".into()) };
        }
        if !self.take("[") {
            return Err("[ after in".into());
        }
        let mut list = Vec::new();
        while !self.take("]") {
            let token = self.next().ok_or("] at the end of a list")?;
            if token != "," {
                list.push(token.parse().map_err(|_| format!("a number, not {token}"))?);
            }
        }
        Ok(Node::In(Box::new(node), list, wanted))
    }

    fn atom(&mut self) -> Result<Node, String> {
        let token = self.next().ok_or("a value at the end")?;
        if token == "(" {
            let inner = self.level(0)?;
            return if self.take(")") { Ok(inner) } else { Err("a closing bracket".into()) };
        }
        if let Ok(number) = token.parse() {
            return Ok(Node::Number(number));
        }
        let name = token.starts_with(char::is_alphabetic);
        if name { Ok(Node::Name(token.into())) } else { Err(format!("a value, not {token}")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(text: &str) -> Option<bool> {
        let values = |name: &str| {
            [("Prm1", 1), ("C5/2", 52), ("big", 60_000)]
                .into_iter()
                .find(|(known, _)| *known == name)
                .map(|(_, value)| value)
        };
        Expression::parse(text).expect("a condition").holds(&values)
    }

    #[test]
    fn multiplication_binds_before_comparison_before_and_before_or() {
        assert_eq!(holds("Prm1 == 2 and Prm1 == 1 or 2 * big + 1 > 120000"), Some(true));
        assert_eq!(holds("Prm1 == 2 and (Prm1 == 1 or 2 * big == 120000)"), Some(false));
        assert_eq!(holds("C5/2 % 10 != 2"), Some(false));
        assert_eq!(holds("Prm1 > -2"), Some(true));
    }

    #[test]
    fn membership_may_be_negated() {
        assert_eq!(holds("Prm1 in [3, 1]"), Some(true));
        assert_eq!(holds("Prm1 not in [3, 1]"), Some(false));
        assert_eq!(holds("Prm1 not in [0, -1] and big > 5"), Some(true));
    }

    #[test]
    fn an_unknown_name_or_a_remainder_of_nothing_has_no_truth() {
        assert_eq!(holds("Prm2 == 1"), None);
        assert_eq!(holds("Prm1 % 0 == 1"), None);
    }

    #[test]
    fn what_is_no_condition_is_refused() {
        for text in ["", "Prm1 ==", "(Prm1", "Prm1 in 3", "Prm1 in [3", "Prm1 not 3", "1 2", "?"] {
            assert!(Expression::parse(text).is_err(), "{text}");
        }
    }
}
