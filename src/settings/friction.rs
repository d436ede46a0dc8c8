//! Coulomb friction coefficients.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Coulomb friction: one coefficient for every contact, or one for each kind of pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Friction {
    /// Coefficient of every contact.
    All(#[schemars(range(min = 0, max = 2))] f64),
    /// Coefficients by kind of pair.
    Pairs(Pairs),
}

/// Coulomb friction coefficients by kind of pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pairs {
    /// Of threads on yarns, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub thread_yarn: f64,
    /// Of yarns on yarns, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub yarn_yarn: f64,
    /// Of threads on threads, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub thread_thread: f64,
}

impl Friction {
    /// The coefficients by kind of pair.
    pub fn pairs(self) -> Pairs {
        match self {
            Self::All(all) => Pairs { thread_yarn: all, yarn_yarn: all, thread_thread: all },
            Self::Pairs(pairs) => pairs,
        }
    }

    /// The largest coefficient.
    pub fn largest(self) -> f64 {
        let Pairs { thread_yarn, yarn_yarn, thread_thread } = self.pairs();
        thread_yarn.max(yarn_yarn).max(thread_thread)
    }

    /// The same with every coefficient above zero replaced.
    pub fn with(self, coefficient: f64) -> Self {
        let replaced = |own: f64| if own > 0.0 { coefficient } else { 0.0 };
        let Pairs { thread_yarn, yarn_yarn, thread_thread } = self.pairs();
        Self::Pairs(Pairs {
            thread_yarn: replaced(thread_yarn),
            yarn_yarn: replaced(yarn_yarn),
            thread_thread: replaced(thread_thread),
        })
    }
}

impl Default for Friction {
    fn default() -> Self {
        Self::All(0.0)
    }
}

impl fmt::Display for Friction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All(all) => write!(f, "{all}"),
            Self::Pairs(Pairs { thread_yarn, yarn_yarn, thread_thread }) => {
                write!(f, "{thread_yarn} of threads on yarns, {yarn_yarn} of yarns, {thread_thread} of threads")
            }
        }
    }
}
