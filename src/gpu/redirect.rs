//! Accesses to arrays turned into calls. Elements are loaded whole or member by member and stored whole; the index is not
//! a constant. An array to which anything else is done is left alone: [`only_elements`].

use super::{layout::Binding, placement::Placement};
use naga::{Block, Expression, Function, GlobalVariable, Handle, Module, Range, Span, Statement};
use std::collections::{HashMap, HashSet};

/// Turn every access to these arrays into a call of the functions of their placement.
pub fn redirect(module: &mut Module, arrays: &[(Binding, Placement)]) {
    let function = |name: String| {
        let found = module.functions.iter().find(|(_, f)| f.name.as_ref() == Some(&name));
        found.expect("declared with the placement").0
    };
    let variables = module.global_variables.iter();
    let moved = variables.filter_map(|(handle, v)| {
        let (binding, placement) = arrays.iter().find(|(array, _)| v.name.as_ref() == Some(&array.name))?;
        let prefix = placement.prefix(binding);
        let [load, store] = ["load", "store"].map(|access| function(format!("{prefix}_{access}")));
        Some((handle, Access { load, store }))
    });
    let moved: HashMap<_, _> = moved.collect();
    let functions = module.functions.iter_mut().map(|(_, f)| f);
    functions.chain(module.entry_points.iter_mut().map(|e| &mut e.function)).for_each(|f| redirect_in(f, &moved));
}

/// Whether elements of an array are only loaded, whole or member by member, and stored whole, so that all that is done
/// to them can become calls.
pub fn only_elements(module: &Module, array: Handle<GlobalVariable>) -> bool {
    let entries = module.entry_points.iter().map(|e| &e.function);
    module.functions.iter().map(|(_, f)| f).chain(entries).all(|f| only_elements_in(f, array))
}

fn only_elements_in(function: &Function, array: Handle<GlobalVariable>) -> bool {
    let (mut whole, mut elements, mut members) = (HashSet::new(), HashSet::new(), HashSet::new());
    for (handle, expression) in function.expressions.iter() {
        let (base, by_name) = match *expression {
            Expression::GlobalVariable(variable) if variable == array => {
                whole.insert(handle);
                continue;
            }
            Expression::Access { base, .. } => (base, false),
            Expression::AccessIndex { base, .. } => (base, true),
            _ => continue,
        };
        match (whole.contains(&base), elements.contains(&base) || members.contains(&base)) {
            (true, _) if !by_name => drop(elements.insert(handle)),
            (_, true) if by_name => drop(members.insert(handle)),
            (false, false) => {}
            _ => return false,
        }
    }
    let mut pending = vec![&function.body];
    while let Some(block) = pending.pop() {
        for statement in block.iter() {
            match statement {
                Statement::Store { pointer, .. } if members.contains(pointer) => return false,
                Statement::Call { arguments, .. }
                    if arguments.iter().any(|a| elements.contains(a) || members.contains(a)) =>
                {
                    return false;
                }
                Statement::Block(block) => pending.push(block),
                Statement::If { accept, reject, .. } => pending.extend([accept, reject]),
                Statement::Switch { cases, .. } => pending.extend(cases.iter().map(|case| &case.body)),
                Statement::Loop { body, continuing, .. } => pending.extend([body, continuing]),
                _ => {}
            }
        }
    }
    true
}

/// The functions that take the place of an array.
#[derive(Clone, Copy)]
struct Access {
    load: Handle<Function>,
    store: Handle<Function>,
}

/// An element that a function points at.
#[derive(Clone, Copy)]
struct Element {
    access: Access,
    index: Handle<Expression>,
}

fn redirect_in(function: &mut Function, moved: &HashMap<Handle<GlobalVariable>, Access>) {
    let mut elements: HashMap<Handle<Expression>, Element> = HashMap::new();
    // Calls to make where an expression is evaluated, and pointers that are not needed any more.
    let mut calls = HashMap::new();
    let mut members = HashMap::new();
    for (handle, expression) in function.expressions.iter() {
        match *expression {
            Expression::Access { base, index } => {
                let Expression::GlobalVariable(variable) = function.expressions[base] else { continue };
                let Some(&access) = moved.get(&variable) else { continue };
                elements.insert(handle, Element { access, index });
            }
            Expression::AccessIndex { base, .. } if elements.contains_key(&base) || members.contains_key(&base) => {
                members.insert(handle, *members.get(&base).unwrap_or(&base));
            }
            Expression::Load { pointer } => {
                // A whole element is the result of the call; for a member, the pointer becomes the element's value.
                let whole = elements.contains_key(&pointer).then_some((handle, pointer));
                let of_member = members.get(&pointer).map(|&element| (element, element));
                if let Some((result, element)) = whole.or(of_member) {
                    calls.insert(result, elements[&element]);
                }
            }
            _ => {}
        }
    }
    for (&handle, element) in &calls {
        *function.expressions.get_mut(handle) = Expression::CallResult(element.access.load);
    }
    for pointer in elements.keys().filter(|pointer| !calls.contains_key(pointer)) {
        *function.expressions.get_mut(*pointer) = Expression::Literal(naga::Literal::U32(0));
    }
    let loads: Vec<_> = function.expressions.iter().map(|(handle, e)| (handle, e.clone())).collect();
    for (handle, expression) in loads {
        if let Expression::Load { pointer } = expression
            && members.contains_key(&pointer)
        {
            *function.expressions.get_mut(handle) = function.expressions[pointer].clone();
        }
    }
    let body = std::mem::take(&mut function.body);
    function.body = redirected(body, &elements, &calls);
}

fn redirected(
    block: Block,
    elements: &HashMap<Handle<Expression>, Element>,
    calls: &HashMap<Handle<Expression>, Element>,
) -> Block {
    let again = |block| redirected(block, elements, calls);
    let mut new = Block::new();
    for statement in block.iter().cloned() {
        let statement = match statement {
            Statement::Emit(range) => {
                emit(range, elements, calls, &mut new);
                continue;
            }
            Statement::Store { pointer, value } if elements.contains_key(&pointer) => {
                let Element { access, index } = elements[&pointer];
                Statement::Call { function: access.store, arguments: vec![index, value], result: None }
            }
            Statement::Block(block) => Statement::Block(again(block)),
            Statement::If { condition, accept, reject } => {
                Statement::If { condition, accept: again(accept), reject: again(reject) }
            }
            Statement::Switch { selector, cases } => {
                let cases = cases.into_iter().map(|case| naga::SwitchCase { body: again(case.body), ..case });
                Statement::Switch { selector, cases: cases.collect() }
            }
            Statement::Loop { body, continuing, break_if } => {
                Statement::Loop { body: again(body), continuing: again(continuing), break_if }
            }
            other => other,
        };
        new.push(statement, Span::UNDEFINED);
    }
    new
}

/// Evaluate a range of expressions, calls among them.
fn emit(
    range: Range<Expression>,
    elements: &HashMap<Handle<Expression>, Element>,
    calls: &HashMap<Handle<Expression>, Element>,
    block: &mut Block,
) {
    let mut run: Option<(Handle<Expression>, Handle<Expression>)> = None;
    let flush = |run: &mut Option<_>, block: &mut Block| {
        if let Some((first, last)) = run.take() {
            block.push(Statement::Emit(Range::new_from_bounds(first, last)), Span::UNDEFINED);
        }
    };
    for handle in range {
        if let Some(element) = calls.get(&handle) {
            flush(&mut run, block);
            let (function, arguments) = (element.access.load, vec![element.index]);
            block.push(Statement::Call { function, arguments, result: Some(handle) }, Span::UNDEFINED);
        } else if elements.contains_key(&handle) {
            flush(&mut run, block);
        } else {
            run = Some((run.map_or(handle, |(first, _)| first), handle));
        }
    }
    flush(&mut run, block);
}
