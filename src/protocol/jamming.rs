//! The jamming fraction of a packing: compression until grains carry a pressure, then states ever closer to where it
//! vanishes, and a fit through them.

use crate::{
    error::Result,
    measure::{
        Packing, Sample,
        micromechanics::coordination::{Coordination, carrying},
    },
    scene::{Assembly, JammingProtocol},
    simulation::Simulation,
};
use serde::{Deserialize, Serialize};

/// A packing whose relaxation has ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RelaxedState {
    pub step: u64,
    /// Volumes of grains over that of the cell, overlaps counted twice.
    pub packing_fraction: f64,
    /// Pa (N/m).
    pub pressure: f64,
    pub coordination_number: f64,
    pub coordination_without_rattlers: Option<f64>,
    pub rattlers: usize,
    /// Mean |total force| over mean |contact force|; None where nothing touches.
    pub residual: Option<f64>,
    /// Whether it has come to rest.
    pub converged: bool,
    /// Whether grains carry a pressure.
    pub jammed: bool,
}

impl RelaxedState {
    fn of(simulation: &mut Simulation, sample: &Sample, converged: bool, jammed: bool) -> Result<RelaxedState> {
        let (grains, walls, contacts) = (simulation.grains()?, simulation.walls()?, simulation.contacts()?);
        let (domain, dims) = (simulation.domain()?, simulation.assembly().dimension);
        let assembly = simulation.assembly_in(domain);
        let packing = Packing::new(&assembly, &grains, &[], &walls, &contacts);
        let coordination = Coordination::of(&packing, &carrying(&packing));
        let stress = sample.cell.map(|cell| cell.stress()).unwrap_or_default();
        Ok(RelaxedState {
            step: sample.step,
            packing_fraction: sample.cell.and_then(|cell| cell.solid_fraction).unwrap_or_default(),
            pressure: stress[..dims].iter().flatten().sum::<f64>() / dims as f64,
            coordination_number: coordination.coordination_number,
            coordination_without_rattlers: coordination.coordination_without_rattlers,
            rattlers: coordination.rattlers,
            residual: Some(sample.unbalanced_force_ratio).filter(|ratio| ratio.is_finite()),
            converged,
            jammed,
        })
    }
}

/// How far the search for it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Jamming {
    pub states: Vec<RelaxedState>,
    /// The step with which the relaxation of now began; None while the cell deforms.
    pub relaxing_since: Option<u64>,
}

/// The packing fraction at which the pressure vanishes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JammingFraction {
    #[serde(rename = "jamming_fraction")]
    pub value: f64,
    /// Standard error of the fit; where there is none, how far states are apart on both sides of it.
    #[serde(rename = "jamming_fraction_error")]
    pub error: f64,
    /// States that the fit goes through.
    #[serde(rename = "jamming_fit_states")]
    pub states: usize,
}

/// How a look at a packing has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// It deforms or relaxes.
    Moving,
    /// There is another state, and the cell deforms on to the next.
    Relaxed,
    /// There is another state, the last one.
    Found,
}

/// 1/(α − 1) of contacts whose energy grows with the overlap to the α: the pressure to this power grows with the packing
/// fraction.
fn exponent(assembly: &Assembly) -> f64 {
    if assembly.pairs[0].hertz.is_some() { 2.0 / 3.0 } else { 1.0 }
}

/// States that a fit with an error needs.
const FEWEST: usize = 3;

impl Jamming {
    /// Look at a packing whose scene asks for it, of which the sample is. The next look is to be at step `next`: until then
    /// the cell deforms to the packing fraction of the next state, if it is time.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) if the device is lost.
    pub fn look(&mut self, simulation: &mut Simulation, sample: &Sample, next: u64) -> Result<Look> {
        let Some(protocol) = simulation.assembly().stop.jamming else { return Ok(Look::Moving) };
        let Some(since) = self.relaxing_since else {
            simulation.deform([0.0; 6])?;
            self.relaxing_since = Some(sample.step);
            return Ok(Look::Moving);
        };
        let (unjammed, balanced) = (simulation.is_unjammed(sample), sample.at_rest(protocol.residual));
        let converged = unjammed || balanced;
        if !converged && sample.step - since < protocol.relaxation_steps {
            return Ok(Look::Moving);
        }
        let state = RelaxedState::of(simulation, sample, converged, !unjammed)?;
        self.states.push(state);
        let Some(target) = self.next(&protocol, exponent(simulation.assembly())) else { return Ok(Look::Found) };
        let dims = simulation.assembly().dimension;
        let time = (next - sample.step) as f64 * simulation.dt();
        let rate = (state.packing_fraction / target).ln() / (dims as f64 * time);
        simulation.deform(std::array::from_fn(|k| if k < dims { rate } else { 0.0 }))?;
        self.relaxing_since = None;
        Ok(Look::Relaxed)
    }

    /// What has been found of a scene.
    pub fn found(&self, assembly: &Assembly) -> Option<JammingFraction> {
        self.fraction(exponent(assembly))
    }

    /// The packing fraction of the next state; None if the last ones are enough. Compression goes on until two states are
    /// jammed, then decompression, each time by half of what is left of the way to zero pressure.
    fn next(&self, protocol: &JammingProtocol, exponent: f64) -> Option<f64> {
        let (last, before) = (self.states.last()?, self.states.iter().rev().nth(1));
        let here = last.packing_fraction;
        let compressed = Some(here + protocol.step);
        if !last.jammed {
            // Decompressed too far: what there was before is enough, or the packing is another one now.
            return if self.branch(exponent).len() < FEWEST { compressed } else { None };
        }
        let Some(before) = before.filter(|before| before.jammed) else { return compressed };
        // Where the line through the last two states meets zero pressure.
        let [x, x1] = [last, before].map(|state| state.pressure.powf(exponent));
        let zero = here - x * (here - before.packing_fraction) / (x - x1);
        match here - zero {
            // The pressure has not changed as it should; the cell has to be another one.
            way if !(way > 0.0 && way.is_finite()) => compressed,
            way if way > protocol.tolerance => Some(here - 0.5 * way),
            _ => None,
        }
    }

    /// The fraction of the last state of the kind.
    fn last(&self, jammed: bool) -> Option<f64> {
        self.states.iter().rev().find(|state| state.jammed == jammed).map(|state| state.packing_fraction)
    }

    /// Jammed states at rest of the last decompression, from its end on: (pressure^exponent, packing fraction).
    fn branch(&self, exponent: f64) -> Vec<(f64, f64)> {
        let mut fraction = f64::NEG_INFINITY;
        let jammed = self.states.iter().rev().skip_while(|state| !state.jammed);
        let denser = jammed.take_while(|state| {
            state.jammed && state.packing_fraction > std::mem::replace(&mut fraction, state.packing_fraction)
        });
        let at_rest = denser.filter(|state| state.converged);
        at_rest.map(|state| (state.pressure.powf(exponent), state.packing_fraction)).collect()
    }

    /// By a line through the jammed states at rest of the last decompression, in pressure^exponent (1/(α − 1) with the
    /// exponent α of the energy of a contact), with equal relative errors. Of fewer than three states the middle of the
    /// last jammed one and the last unjammed one.
    pub fn fraction(&self, exponent: f64) -> Option<JammingFraction> {
        let branch = self.branch(exponent);
        let states = branch.len();
        if states < FEWEST {
            let (above, below) = (self.last(true)?, self.last(false)?);
            return Some(JammingFraction { value: 0.5 * (above + below), error: 0.5 * (above - below).abs(), states });
        }
        let sum = |of: &dyn Fn(f64, f64) -> f64| branch.iter().map(|(x, y)| of(*x, *y) / (x * x)).sum::<f64>();
        let (w, wx, wxx) = (sum(&|_, _| 1.0), sum(&|x, _| x), sum(&|x, _| x * x));
        // From the state with the least pressure, so that no digit is lost.
        let (_, first) = branch[0];
        let (wy, wxy) = (sum(&|_, y| y - first), sum(&|x, y| x * (y - first)));
        let determinant = w * wxx - wx * wx;
        let (value, slope) = ((wxx * wy - wx * wxy) / determinant, (w * wxy - wx * wy) / determinant);
        let scatter = sum(&|x, y| (y - first - value - slope * x).powi(2)) / (states - 2) as f64;
        Some(JammingFraction { value: first + value, error: (scatter * wxx / determinant).sqrt(), states })
    }

    /// Those that have not come to rest.
    pub fn unconverged(&self) -> usize {
        self.states.iter().filter(|state| !state.converged).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROTOCOL: JammingProtocol =
        JammingProtocol { step: 0.01, tolerance: 1e-4, residual: 1e-5, relaxation_steps: 1000 };

    /// A packing that jams at a fraction, with a pressure that grows with some power of what is above.
    fn search(jams_at: f64, power: f64, unconverged: usize) -> Jamming {
        let mut jamming = Jamming::default();
        let mut phi = 0.6;
        for step in 0..500 {
            let above = f64::max(phi - jams_at, 0.0);
            jamming.states.push(RelaxedState {
                step,
                packing_fraction: phi,
                pressure: 3.0 * above.powf(power) * (1.0 + 2.0 * above),
                coordination_number: 4.0,
                coordination_without_rattlers: Some(4.0),
                rattlers: 0,
                residual: Some(1e-6),
                converged: jamming.states.len() != unconverged,
                jammed: above > 0.0,
            });
            match jamming.next(&PROTOCOL, 1.0 / power) {
                Some(next) => phi = next,
                None => return jamming,
            }
        }
        panic!("never ends: {jamming:?}")
    }

    #[test]
    fn a_pressure_that_vanishes_is_found() {
        for (jams_at, power) in [(0.8415, 1.0), (0.64, 1.0), (0.6391, 1.5), (0.60003, 1.0)] {
            let jamming = search(jams_at, power, usize::MAX);
            let found = jamming.fraction(1.0 / power).unwrap();
            assert!((found.value - jams_at).abs() < 1e-5, "{jams_at}: {found:?}");
            assert!(found.error > 0.0 && (found.value - jams_at).abs() < 4.0 * found.error, "{found:?}");
            assert!(found.states >= 4, "{found:?}");
            let last = jamming.states.last().unwrap();
            assert!(last.jammed && last.packing_fraction - jams_at < 1.2e-4, "{last:?}");
        }
    }

    #[test]
    fn states_that_move_are_not_fitted() {
        let all = search(0.8415, 1.0, usize::MAX);
        let without = search(0.8415, 1.0, all.states.len() - 1);
        let count = |jamming: &Jamming| jamming.fraction(1.0).unwrap().states;
        assert_eq!(without.unconverged(), 1);
        assert_eq!(count(&without) + 1, count(&all));
        // Of two states on both sides the middle, with half of the distance.
        let mut two = all.clone();
        two.states.truncate(all.states.iter().position(|state| state.jammed).unwrap() + 1);
        let found = two.fraction(1.0).unwrap();
        assert!((found.error - 0.005).abs() < 1e-12 && (found.value - 0.8415).abs() <= found.error, "{found:?}");
    }
}
