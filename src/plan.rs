//! The language of plans: operations in order, and loops around them. A plan is a value that can be printed; whoever
//! walks it, a simulation or `check`, decides how often its loops go round. The plans themselves stand in their
//! chapters, `src/CHAPTER/plan.rs`.

use crate::{error::Result, model::Model, stage::Stage, state::Array};
use std::fmt::{self, Write};

/// An operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// Run a kernel or its twin.
    Run(&'static Stage),
    /// Set an array to zero.
    Clear(&'static Array),
    /// Exchange two arrays without moving them.
    Swap(&'static Array, &'static Array),
}

/// How often a part of a plan is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loop {
    /// Once, if the neighbour lists have served their time.
    IfListsAreUsedUp,
    /// Again with longer lists if they have turned out too short; nothing else has happened then.
    UntilListsFit,
    /// Once, if that was the case, so that grains have been sorted.
    IfGrainsAreSorted,
    /// As many steps as the lists serve. A step that uses up their margin halts those that follow.
    Steps,
    /// Those that were halted.
    HaltedSteps,
    /// Again with lists that reach farther if a step of contact dynamics has left them.
    UntilStepIsWithinLists,
    /// Once, if it has, or has lost a grain: then it is taken back.
    IfStepIsTakenBack,
    Times(u32),
    /// Once, if this is the first step with these lists.
    IfListsAreNew,
    /// Until the residual of the contacts is small enough.
    UntilSolved,
    /// Once, if there are contacts without a colour.
    IfContactsAreNew,
    UntilColored,
    /// Once, if there are more colours or contacts than the arrays hold, which are given room.
    IfColorsDoNotFit,
    /// As many passes as are worth doing before the next look at the residual.
    Passes,
    ForEachColor,
}

impl Loop {
    /// Whether a plan may go on without a round of it.
    fn may_be_left_out(self) -> bool {
        !matches!(
            self,
            Loop::UntilListsFit
                | Loop::Steps
                | Loop::UntilStepIsWithinLists
                | Loop::Times(_)
                | Loop::UntilSolved
                | Loop::UntilColored
        )
    }

    fn label(self) -> String {
        match self {
            Loop::IfListsAreUsedUp => "if the neighbour lists are used up",
            Loop::UntilListsFit => "until the lists fit, and nothing is done before they do",
            Loop::IfGrainsAreSorted => "if the grains have been sorted",
            Loop::Steps => "for each step that the lists serve",
            Loop::HaltedSteps => "for each step that was halted",
            Loop::UntilStepIsWithinLists => "until the step stays within the reach of the lists",
            Loop::IfStepIsTakenBack => "if it does not, take it back",
            Loop::Times(n) => return format!("{n} times"),
            Loop::IfListsAreNew => "if the neighbour lists are new",
            Loop::UntilSolved => "until the residual is small",
            Loop::IfContactsAreNew => "if contacts have no colour",
            Loop::UntilColored => "until all contacts have a colour",
            Loop::IfColorsDoNotFit => "if they do not fit, begin anew",
            Loop::Passes => "for some passes",
            Loop::ForEachColor => "for each colour",
        }
        .to_owned()
    }
}

/// Operations and loops, in order.
#[derive(Clone, Debug, Default)]
pub struct Plan(Vec<Item>);

#[derive(Clone, Debug)]
enum Item {
    Do(Op),
    SolveOnHost,
    Repeat(Loop, Plan),
}

/// One after the other.
pub fn plan<const N: usize>(parts: [Plan; N]) -> Plan {
    Plan(parts.into_iter().flat_map(|part| part.0).collect())
}

/// The contacts of a step of contact dynamics, solved by the host.
pub fn solve_on_host() -> Plan {
    Plan(vec![Item::SolveOnHost])
}

pub fn run(stage: &'static Stage) -> Plan {
    Plan(vec![Item::Do(Op::Run(stage))])
}

/// Stages one after the other.
pub fn run_all(stages: &'static [Stage]) -> Plan {
    Plan(stages.iter().map(|stage| Item::Do(Op::Run(stage))).collect())
}

pub fn clear<const N: usize>(arrays: [&'static Array; N]) -> Plan {
    Plan(arrays.into_iter().map(|array| Item::Do(Op::Clear(array))).collect())
}

/// Exchanges again.
pub fn swap_again(swaps: &[Op]) -> Plan {
    Plan(swaps.iter().map(|op| Item::Do(*op)).collect())
}

/// Exchange each pair, if the model has these arrays.
pub fn swap<const N: usize>(model: &Model, pairs: [(&'static Array, &'static Array); N]) -> Plan {
    let present = pairs.into_iter().filter(|(a, _)| (a.needed)(model));
    Plan(present.map(|(a, b)| Item::Do(Op::Swap(a, b))).collect())
}

/// A loop; nothing around nothing.
pub fn repeat(times: Loop, body: Plan) -> Plan {
    if body.0.is_empty() { body } else { Plan(vec![Item::Repeat(times, body)]) }
}

/// Who walks a plan.
pub trait Driver {
    /// Do an operation, or remember to do it before anything is asked of the device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device cannot.
    fn run(&mut self, op: Op) -> Result<()>;

    /// Solve the contacts of a step on the host.
    ///
    /// # Errors
    /// As [`Driver::run`], and what the solver says.
    fn solve_on_host(&mut self) -> Result<()> {
        unreachable!("only a step of contact dynamics is solved")
    }

    /// How often the body of a loop is done next, after it has been done `done` times; 0 ends the loop.
    ///
    /// # Errors
    /// As [`Driver::run`].
    fn rounds(&mut self, of: Loop, done: u32) -> Result<u32>;
}

impl Plan {
    /// The plan, or nothing.
    #[must_use]
    pub fn when(self, condition: bool) -> Plan {
        if condition { self } else { Plan::default() }
    }

    /// Do it.
    ///
    /// # Errors
    /// Those of the driver.
    pub fn walk(&self, driver: &mut dyn Driver) -> Result<()> {
        for item in &self.0 {
            match item {
                Item::Do(op) => driver.run(*op)?,
                Item::SolveOnHost => driver.solve_on_host()?,
                Item::Repeat(of, body) => {
                    let mut done = 0;
                    loop {
                        let rounds = driver.rounds(*of, done)?;
                        if rounds == 0 {
                            break;
                        }
                        (0..rounds).try_for_each(|_| body.walk(driver))?;
                        done += rounds;
                    }
                }
            }
        }
        Ok(())
    }

    /// What is wanted before it, as bits, if these are after it: `before` says so of an operation. `lists_are_made`:
    /// whether neighbour lists are made anew in it. Operations that have no effect count for nothing: those of lists
    /// that do not fit, and of halted steps, whose exchanges are done again.
    pub fn backwards(&self, after: u128, lists_are_made: bool, before: &mut dyn FnMut(Op, u128) -> u128) -> u128 {
        self.0.iter().rev().fold(after, |after, item| match item {
            Item::Do(op) => before(*op, after),
            Item::SolveOnHost | Item::Repeat(Loop::HaltedSteps, _) => after,
            Item::Repeat(Loop::UntilListsFit, body) => body.backwards(after, lists_are_made, before),
            Item::Repeat(Loop::IfListsAreUsedUp | Loop::IfGrainsAreSorted, body) if lists_are_made => {
                body.backwards(after, true, before)
            }
            Item::Repeat(Loop::IfListsAreUsedUp | Loop::IfGrainsAreSorted, _) => after,
            Item::Repeat(of, body) => {
                // After a round may come another one.
                let mut wanted = after;
                loop {
                    let rounds = [false, true].map(|lists| body.backwards(wanted, lists, before));
                    let all = wanted | rounds[0] | rounds[1];
                    if all == wanted {
                        break;
                    }
                    wanted = all;
                }
                let before = body.backwards(wanted, lists_are_made, before);
                if of.may_be_left_out() { after | before } else { before }
            }
        })
    }

    /// All its operations of an engine once, in order, loops or not.
    pub fn ops(&self) -> Vec<Op> {
        let ops = |item: &Item| match item {
            Item::Do(op) => vec![*op],
            Item::SolveOnHost => Vec::new(),
            Item::Repeat(_, body) => body.ops(),
        };
        self.0.iter().flat_map(ops).collect()
    }

    /// Its exchanges of arrays alone.
    pub fn swaps(&self) -> Vec<Op> {
        self.ops().into_iter().filter(|op| matches!(op, Op::Swap(..))).collect()
    }

    /// Whether a stage is run in it.
    pub fn runs(&self, stage: &Stage) -> bool {
        self.ops().iter().any(|op| op.stage().is_some_and(|s| s == stage))
    }

    /// The bodies of these loops.
    pub fn within(&self, of: Loop) -> Plan {
        let body = |item: &Item| match item {
            Item::Do(_) | Item::SolveOnHost => Plan::default(),
            Item::Repeat(this, body) if *this == of => body.clone(),
            Item::Repeat(_, body) => body.within(of),
        };
        Plan(self.0.iter().flat_map(|item| body(item).0).collect())
    }

    /// Operations fill lines; the bodies of loops are indented.
    fn print(&self, f: &mut fmt::Formatter<'_>, indent: usize) -> fmt::Result {
        const WIDTH: usize = 116;
        let mut line = String::new();
        let end = |f: &mut fmt::Formatter<'_>, line: &mut String| match std::mem::take(line) {
            line if line.is_empty() => Ok(()),
            line => writeln!(f, "{:indent$}{line}", ""),
        };
        for item in &self.0 {
            match item {
                Item::Do(_) | Item::SolveOnHost => {
                    let op = match item {
                        Item::Do(op) => op.to_string(),
                        _ => "solve on the host".to_owned(),
                    };
                    if !line.is_empty() {
                        line.push(',');
                    }
                    if indent + line.len() + op.len() > WIDTH {
                        end(f, &mut line)?;
                    }
                    write!(line, "{}{op}", if line.is_empty() { "" } else { " " })?;
                }
                Item::Repeat(of, body) => {
                    end(f, &mut line)?;
                    writeln!(f, "{:indent$}{}:", "", of.label())?;
                    body.print(f, indent + 2)?;
                }
            }
        }
        end(f, &mut line)
    }
}

impl Op {
    /// The stage it runs, if it runs one.
    pub fn stage(&self) -> Option<&'static Stage> {
        if let Op::Run(stage) = self { Some(*stage) } else { None }
    }
}

impl fmt::Display for Op {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Op::Run(stage) => write!(f, "{}", stage.name),
            Op::Clear(array) => write!(f, "clear {}", array.name),
            Op::Swap(a, b) => write!(f, "{} <-> {}", a.name, b.name),
        }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.print(f, 0)
    }
}
