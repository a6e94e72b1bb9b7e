//! A recording corrected for the effects of a description.

use rig_shared::effects::{Kind, Memory};
use rig_shared::multibody::{Chain, column, inverse_dynamics};
use rig_shared::scalar::Real as _;

use crate::block::{Block, JointColumns};
use crate::prepare::{
    LowPass, Piece, PrepareError, PreprocessingPlan, Recording, central_difference, each_piece,
    later, second_difference, stretch,
};
use crate::runs::travel;
use rig_model::effects::{Effects, State, Turn, is_torque, outruns, shifted};

/// Rows that are processed together.
const CORE: usize = 1 << 16;

/// A recording with corrected positions and with the torque of the described effects in [`JointColumns::effects`].
/// Other columns are unchanged.
///
/// The effects act on motion and torque behind the position filter of the treatment. Hidden states continue from row to
/// row of a stretch and start at 0. The load that a gear transmits is the torque minus the drive inertia, the described
/// friction and all other effects on the motor side.
pub struct Compensated<'a> {
    inner: &'a dyn Recording,
    effects: &'a Effects,
    chain: &'a Chain<f64>,
    filter: LowPass,
    period: f64,
    lead: f64,
    measured_derivatives: bool,
    loads: bool,
}

impl<'a> Compensated<'a> {
    /// Compensates `inner`; payloads only if `loads` is true.
    ///
    /// # Errors
    /// [`PrepareError::Cutoff`] if the treatment has no position filter.
    pub fn new(
        inner: &'a dyn Recording,
        effects: &'a Effects,
        chain: &'a Chain<f64>,
        plan: &PreprocessingPlan,
        loads: bool,
    ) -> Result<Self, PrepareError> {
        let filter = plan.position_filter().ok_or_else(|| PrepareError::Cutoff {
            cutoff: plan.cutoff,
            rate: plan.sample_rate,
            nyquist: plan.sample_rate / 2.0,
        })?;
        Ok(Self {
            inner,
            effects,
            chain,
            filter,
            period: plan.dt(),
            lead: plan.torque_lead,
            measured_derivatives: plan.measured_derivatives,
            loads,
        })
    }
}

fn stopped(e: impl std::fmt::Display) -> PrepareError {
    PrepareError::Stopped(e.to_string())
}

/// State that continues from piece to piece.
struct Running {
    memory: Vec<Memory<f64>>,
    segment: usize,
    /// Time of the last processed row, s.
    last_time: f64,
    first_time: f64,
    first_temperature: Vec<Option<f64>>,
    scratch: Scratch,
}

/// Motion and torque of one joint over a piece, as input of the effects.
struct Seen {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    /// Torque without the sensor's errors: as recorded, and filtered.
    raw: Vec<f64>,
    torque: Vec<f64>,
}

impl Recording for Compensated<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.inner)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        let longest = (0..self.effects.loads().len())
            .map(|j| self.effects.effort(j).0 / self.period)
            .fold(0.0, f64::max);
        let margin = self.filter.settle_samples() + longest.ceil() as usize + 4;
        let mut running: Option<Running> = None;
        each_piece(self.inner, CORE.max(margin), margin, &mut |mut piece| {
            if running.is_none() {
                let first_time = piece.rows.t.first().copied().unwrap_or(0.0);
                running = Some(Running {
                    memory: vec![Memory::default(); self.effects.placed().len()],
                    segment: piece.segment,
                    last_time: first_time,
                    first_time,
                    first_temperature: temperatures(&piece, piece.core_start),
                    scratch: Scratch::of(self.effects.loads().len()),
                });
            }
            if let Some(running) = &mut running {
                if running.segment != piece.segment {
                    running.segment = piece.segment;
                    let first = piece.rows.t.get(piece.core_start).copied();
                    let gap = first.unwrap_or(running.last_time) - running.last_time;
                    for (memory, placed) in running.memory.iter_mut().zip(self.effects.placed()) {
                        *memory = placed.effect.after_pause(*memory, gap);
                    }
                }
                self.work(&mut piece, running)?;
            }
            for start in (piece.core_start..piece.core_end).step_by(rows.max(1)) {
                let end = start.saturating_add(rows.max(1)).min(piece.core_end);
                let mut block = stretch(&piece.rows, start, end);
                block.continues = piece.offset + start as u64 > 0;
                take(block)?;
            }
            Ok(())
        })
    }
}

/// Intermediate values of a row, per joint, N·m or N.
struct Scratch {
    /// Torque of the effects.
    sum: Vec<f64>,
    /// Remaining torque that the gear transmits.
    behind: Vec<f64>,
    /// Relative contact deflection in presliding, otherwise the direction of motion.
    slid: Vec<f64>,
    /// Friction of the effects that act through the contact over the joint's own friction, 1. Presliding uses the
    /// previous row.
    beside: Vec<f64>,
    /// Travel since the previous row.
    travel: Vec<f64>,
}

impl Scratch {
    fn of(joints: usize) -> Self {
        let zeros = || vec![0.0; joints];
        Self {
            sum: zeros(),
            behind: zeros(),
            slid: zeros(),
            beside: zeros(),
            travel: zeros(),
        }
    }
}

/// Returns the temperature of each joint at a row.
fn temperatures(piece: &Piece, row: usize) -> Vec<Option<f64>> {
    let joints = piece.rows.joints.iter();
    joints
        .map(|j| j.temperature.as_ref().and_then(|t| t.get(row).copied()))
        .collect()
}

impl Compensated<'_> {
    /// Corrects the positions of a piece and computes the torque of the effects.
    fn work(&self, piece: &mut Piece, running: &mut Running) -> Result<(), PrepareError> {
        self.correct_positions(piece)?;
        let seen = piece
            .rows
            .joints
            .iter()
            .enumerate()
            .map(|(j, column)| self.seen(j, column))
            .collect::<Vec<Seen>>();
        let joints = seen.len();
        let mut known: Vec<Vec<f64>> = seen
            .iter()
            .zip(&piece.rows.joints)
            .map(|(s, column)| {
                let pairs = column.tau.iter().zip(&s.raw);
                pairs.map(|(read, acting)| read - acting).collect()
            })
            .collect();
        let mut row = [vec![0.0; joints], vec![0.0; joints], vec![0.0; joints]];
        let (mut motor, mut drive) = (vec![0.0; joints], vec![0.0; joints]);
        let mut motor_velocity = vec![0.0; joints];
        let mut warming = vec![0.0; joints];
        for r in piece.core_start..piece.core_end {
            for (j, s) in seen.iter().enumerate() {
                (row[0][j], row[1][j], row[2][j]) = (s.q[r], s.qd[r], s.qdd[r]);
                drive[j] = s.torque.get(r).copied().unwrap_or(0.0);
                running.scratch.travel[j] = travel([&s.q, &s.qd], r, self.period);
            }
            for ((to, now), first) in warming
                .iter_mut()
                .zip(temperatures(piece, r))
                .zip(&running.first_temperature)
            {
                *to = now.zip(*first).map_or(0.0, |(now, first)| now - first);
            }
            self.effects
                .motor_angles(&row[0], &mut motor)
                .map_err(stopped)?;
            (self.effects.transmission())
                .motor_velocity(&row[0], &row[1], &mut motor_velocity)
                .map_err(stopped)?;
            let state = State {
                q: &row[0],
                qd: &row[1],
                qdd: &row[2],
                motor: &motor,
                drive: &drive,
                time: piece.rows.t[r] - running.first_time,
                warming: &warming,
                period: self.period,
            };
            running.last_time = piece.rows.t[r];
            self.torques(&state, &motor_velocity, running);
            let sum = &mut running.scratch.sum;
            if self.loads && self.effects.loads().iter().flatten().any(|x| *x != 0.0) {
                let mut load = vec![0.0; joints];
                let loads = self.effects.loads();
                inverse_dynamics(self.chain, loads, &row[0], &row[1], &row[2], &mut load)
                    .map_err(stopped)?;
                for (to, from) in sum.iter_mut().zip(load) {
                    *to += from;
                }
            }
            for (to, torque) in known.iter_mut().zip(sum) {
                to[r] += *torque;
            }
        }
        for (column, known) in piece.rows.joints.iter_mut().zip(known) {
            column.effects = Some(known);
        }
        Ok(())
    }

    /// Computes the effect torques of all joints along a motion; hidden states continue.
    fn torques(
        &self,
        at: &State<'_>,
        motor_velocity: &[f64],
        Running {
            memory, scratch, ..
        }: &mut Running,
    ) {
        let Scratch {
            sum,
            behind,
            slid,
            beside,
            travel,
        } = scratch;
        let placed = self.effects.placed();
        for (j, p) in self.effects.standard().iter().take(at.qd.len()).enumerate() {
            sum[j] = 0.0;
            slid[j] = at.qd[j].sgn();
            behind[j] = at.drive[j]
                - p[column::DRIVE_INERTIA] * at.qdd[j]
                - self.effects.friction(j, at.qd[j], slid[j])
                - p[column::OFFSET];
        }
        for turn in [Turn::Presliding, Turn::Others] {
            if turn == Turn::Others {
                beside.fill(0.0);
            }
            for (k, p) in placed.iter().enumerate() {
                let kind = p.effect.kind;
                if !is_torque(kind) || Turn::of(kind) != turn {
                    continue;
                }
                if outruns(kind, &p.effect.shapes, motor_velocity[p.joint], at.period) {
                    continue;
                }
                let mut instant = self.effects.instant(k, at);
                let through = kind.acts_through_contact();
                instant.direction = if through { 1.0 } else { at.qd[p.joint].sgn() };
                if kind.is_presliding() {
                    instant.extra_friction_ratio = beside[p.joint];
                    instant.travel = travel[p.joint];
                }
                let mut torque = p.effect.torque(&mut memory[k], &instant);
                if kind.is_presliding() {
                    slid[p.joint] = p
                        .effect
                        .contact_deflection(&memory[k], instant.extra_friction_ratio);
                }
                if through {
                    beside[p.joint] += self.effects.over_coulomb(p.joint, torque);
                    torque *= slid[p.joint];
                }
                sum[p.joint] += torque;
                if !kind.acts_on_link() {
                    behind[p.joint] -= torque;
                }
            }
        }
        for (j, behind) in behind.iter().enumerate() {
            // The rest is load + c·|carried|·direction, with carried = load + link_friction·friction. If there are
            // several such effects, their shares are weighted; they carry in the same direction except near zero.
            let of = placed.iter().map(|p| (p.joint, &p.effect));
            let [coefficient, weighed] = of
                .filter(|(joint, effect)| *joint == j && effect.kind == Kind::LoadFriction)
                .map(|(_, effect)| [effect.gains[0], effect.gains[0] * effect.shapes[0]])
                .fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            if coefficient == 0.0 {
                continue;
            }
            let direction = slid[j];
            let friction = weighed / coefficient * self.effects.friction(j, at.qd[j], direction);
            let both = behind + friction;
            let carried = both / (1.0 + coefficient * direction * both.sgn());
            sum[j] += coefficient * carried.abs() * direction;
            beside[j] += self.effects.over_coulomb(j, coefficient * carried.abs());
        }
    }

    fn correct_positions(&self, piece: &mut Piece) -> Result<(), PrepareError> {
        let joints = piece.rows.joints.len();
        let still = vec![0.0; joints];
        let mut errors = vec![[0.0; 2]; joints];
        let mut guess = vec![0.0; joints];
        for r in 0..piece.rows.len() {
            // The error is a function of the true position. Two iterations suffice for errors far below its period.
            let read: Vec<f64> = piece.rows.joints.iter().map(|j| j.q[r]).collect();
            guess.copy_from_slice(&read);
            for _ in 0..2 {
                self.effects
                    .position_errors(&guess, &still, &mut errors)
                    .map_err(stopped)?;
                for ((to, read), error) in guess.iter_mut().zip(&read).zip(&errors) {
                    *to = read - error[0];
                }
            }
            for (column, q) in piece.rows.joints.iter_mut().zip(&guess) {
                column.q[r] = *q;
            }
        }
        Ok(())
    }

    fn seen(&self, j: usize, column: &JointColumns) -> Seen {
        let (dt, filter) = (self.period, &self.filter);
        let q = filter.zero_phase(&column.q);
        let (qd, qdd) = match &column.qd {
            Some(qd) if self.measured_derivatives => {
                let qd = filter.zero_phase(qd);
                let qdd = match &column.qdd {
                    Some(qdd) => filter.zero_phase(qdd),
                    None => central_difference(&qd, dt),
                };
                (qd, qdd)
            }
            _ => (central_difference(&q, dt), second_difference(&q, dt)),
        };
        let (q, qd, qdd) = later(q, qd, qdd, self.lead, dt);
        let (delay, offset) = self.effects.effort(j);
        let raw: Vec<f64> = shifted(&column.tau, delay / dt)
            .into_iter()
            .map(|tau| tau - offset)
            .collect();
        Seen {
            torque: filter.zero_phase(&raw),
            q,
            qd,
            qdd,
            raw,
        }
    }
}
