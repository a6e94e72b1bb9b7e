//! Equations of motion of winding, rotor, gear and link, integrated in substeps.

use super::config::PlantConfig;
use super::effect::transmission::Transmission;
use super::friction::{Contact, Friction, Reaction, Scale};
use super::truth::{Energy, Truth};

/// Values that are constant between two sampling instants.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) duty: f64,
    pub(super) on: bool,
    /// Open-circuit supply, V.
    pub(super) supply: f64,
    /// Ω, warm.
    pub(super) resistance: f64,
    /// Joint-side, warm, N·m/A.
    pub(super) torque_constant: f64,
    pub(super) load_inertia: f64,
    /// (gc, gs), N·m.
    pub(super) gravity: (f64, f64),
    /// Torque on the link from outside, N·m.
    pub(super) external: f64,
    pub(super) coulomb_scale: f64,
    pub(super) viscous_scale: f64,
}

/// Heat since the last query, J.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Heat {
    pub(super) winding: f64,
    pub(super) friction: f64,
}

/// Angle and speed of one mass, joint-side.
#[derive(Clone, Copy, Debug, Default)]
struct Mass {
    angle: f64,
    speed: f64,
    /// Speed one substep ago, to extrapolate the damping to the middle of the next.
    last: f64,
}

impl Mass {
    fn half(&self, half: f64) -> f64 {
        self.angle + self.speed * half
    }

    fn set(&mut self, angle_half: f64, middle: f64, half: f64) {
        self.last = self.speed;
        self.speed = 2.0 * middle - self.speed;
        self.angle = angle_half + self.speed * half;
    }
}

/// Effect of the winding on the rotor in one substep: torque = offset − slope·speed.
struct Winding {
    voltage: f64,
    inverse: f64,
    source: f64,
}

/// Mechanical and electrical state.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    dt: f64,
    substeps: u32,
    ratio: f64,
    rotor_inertia: f64,
    inductance: f64,
    transmission: Option<Transmission>,
    motor_friction: Friction,
    link_friction: Friction,
    motor_contact: Contact,
    link_contact: Contact,
    rotor: Mass,
    link: Mass,
    current: f64,
    voltage: f64,
    bus: f64,
    drive_torque: f64,
    friction_torque: f64,
    transmitted: f64,
    acceleration: f64,
    flows: Energy,
    heat: Heat,
}

impl Dynamics {
    pub(super) fn new(config: &PlantConfig) -> Self {
        let mechanism = &config.mechanism;
        let substeps = config.substeps.max(1);
        let dt = config.tick / f64::from(substeps);
        let motor_friction = config.motor.friction.seen_through(mechanism.ratio);
        let rest = Mass {
            angle: config.initial_position,
            ..Mass::default()
        };
        Self {
            dt,
            substeps,
            ratio: mechanism.ratio,
            rotor_inertia: mechanism.ratio * mechanism.ratio * config.motor.rotor_inertia,
            inductance: config.motor.inductance,
            transmission: Transmission::new(mechanism.elasticity, mechanism.backlash),
            motor_contact: Contact::new(&motor_friction, dt),
            link_contact: Contact::new(&mechanism.friction, dt),
            motor_friction,
            link_friction: mechanism.friction,
            rotor: rest,
            link: rest,
            current: 0.0,
            voltage: 0.0,
            bus: config.bridge.supply,
            drive_torque: 0.0,
            friction_torque: 0.0,
            transmitted: 0.0,
            acceleration: 0.0,
            flows: Energy::default(),
            heat: Heat::default(),
        }
    }

    pub(super) fn motor_angle(&self) -> f64 {
        self.rotor.angle * self.ratio
    }

    pub(super) fn current(&self) -> f64 {
        self.current
    }

    pub(super) fn bus(&self) -> f64 {
        self.bus
    }

    pub(super) fn take_heat(&mut self) -> Heat {
        core::mem::take(&mut self.heat)
    }

    /// Returns the kinetic and gravitational energy of bodies of this inertia and gravity on the link, J.
    pub(super) fn body_energy(&self, inertia: f64, (gc, gs): (f64, f64)) -> f64 {
        let (s, c) = self.link.angle.sin_cos();
        0.5 * inertia * self.link.speed * self.link.speed + gc * s - gs * c
    }

    /// Adds energy from outside to the balance.
    pub(super) fn receive(&mut self, energy: f64) {
        self.flows.external += energy;
    }

    /// Integrates over one control tick.
    pub(super) fn tick(&mut self, config: &PlantConfig, held: &Held) {
        let (s, c) = self.link.angle.sin_cos();
        let (gc, gs) = held.gravity;
        // Gravity about the start of the tick, to second order: within 100 µs the third order is below 1e-9 of it.
        let gravity = (self.link.angle, gc * c + gs * s, gs * c - gc * s);
        let place =
            |friction: &Friction, angle: f64| friction.position.map_or(1.0, |p| p.scale(angle));
        let motor_scale = held.coulomb_scale * place(&self.motor_friction, self.rotor.angle);
        let link_scale = held.coulomb_scale * place(&self.link_friction, self.link.angle);
        for _ in 0..self.substeps {
            if self.transmission.is_some() {
                self.substep_two_masses(config, held, gravity, motor_scale, link_scale);
            } else {
                self.substep_rigid(config, held, gravity, motor_scale, link_scale);
            }
        }
        if self.transmission.is_none() {
            self.rotor = self.link;
        }
        self.bus = if held.on {
            held.supply - config.bridge.supply_resistance * held.duty * self.current
        } else {
            // The free-wheeling current flows back into the supply, with either sign.
            held.supply + config.bridge.supply_resistance * self.current.abs()
        };
    }

    #[inline]
    fn substep_rigid(
        &mut self,
        config: &PlantConfig,
        held: &Held,
        gravity: (f64, f64, f64),
        motor_scale: f64,
        link_scale: f64,
    ) {
        let half = 0.5 * self.dt;
        let speed = self.link.speed;
        let angle = self.link.half(half);
        let motor = react(
            &mut self.motor_contact,
            &self.motor_friction,
            speed,
            self.dt,
            motor_scale,
            self.transmitted,
        );
        let link = react(
            &mut self.link_contact,
            &self.link_friction,
            speed,
            self.dt,
            link_scale,
            self.transmitted,
        );
        let passive = self.link_torque(config, gravity, angle);
        let rotor = self.rotor_torque(config, angle);
        let torque = passive + held.external + rotor - motor.torque - link.torque;
        let (motor_damping, link_damping) = (
            damping(&self.motor_friction, held, motor, speed),
            damping(&self.link_friction, held, link, speed),
        );
        let inertia = self.rotor_inertia + held.load_inertia;
        let (middle, drive) = self.kick(
            config,
            held,
            angle,
            speed,
            inertia,
            motor_damping + link_damping,
            torque,
        );

        let motor_torque = motor.torque + motor_damping * middle;
        let link_torque = link.torque + link_damping * middle;
        self.drive_torque = drive;
        self.friction_torque = motor_torque + link_torque;
        self.acceleration = (middle - speed) / half;
        self.transmitted = drive + rotor - motor_torque - self.rotor_inertia * self.acceleration;
        self.book(
            motor_torque * middle + link_torque * middle,
            held.external * middle,
        );
        self.book_stops(config, angle, middle);
        self.link.set(angle, middle, half);
    }

    fn substep_two_masses(
        &mut self,
        config: &PlantConfig,
        held: &Held,
        gravity: (f64, f64, f64),
        motor_scale: f64,
        link_scale: f64,
    ) {
        let Some(transmission) = self.transmission else {
            return;
        };
        let half = 0.5 * self.dt;
        let (rotor_speed, link_speed) = (self.rotor.speed, self.link.speed);
        let (rotor_angle, link_angle) = (self.rotor.half(half), self.link.half(half));
        // Relative speed extrapolated to the middle, so that the damping is of second order too.
        let rate = rotor_speed - link_speed
            + 0.5 * (rotor_speed - self.rotor.last - link_speed + self.link.last);
        let twist = rotor_angle - link_angle;
        let passed = transmission.torque(twist, rate);
        let motor = react(
            &mut self.motor_contact,
            &self.motor_friction,
            rotor_speed,
            self.dt,
            motor_scale,
            passed,
        );
        let link = react(
            &mut self.link_contact,
            &self.link_friction,
            link_speed,
            self.dt,
            link_scale,
            passed,
        );

        let rotor_damping = damping(&self.motor_friction, held, motor, rotor_speed);
        let torque = self.rotor_torque(config, rotor_angle) - motor.torque - passed;
        let (rotor_middle, drive) = self.kick(
            config,
            held,
            rotor_angle,
            rotor_speed,
            self.rotor_inertia,
            rotor_damping,
            torque,
        );

        let link_damping = damping(&self.link_friction, held, link, link_speed);
        let passive = self.link_torque(config, gravity, link_angle);
        let inertia = held.load_inertia / half;
        let link_middle = (inertia * link_speed + passive + held.external + passed - link.torque)
            / (inertia + link_damping);

        let motor_torque = motor.torque + rotor_damping * rotor_middle;
        let link_torque = link.torque + link_damping * link_middle;
        self.drive_torque = drive;
        self.friction_torque = motor_torque + link_torque;
        self.acceleration = (link_middle - link_speed) / half;
        self.transmitted = passed;
        self.book(
            motor_torque * rotor_middle + link_torque * link_middle,
            held.external * link_middle,
        );
        self.flows.contact +=
            (passed - transmission.torque_elastic(twist)) * (rotor_middle - link_middle) * self.dt;
        self.book_stops(config, link_angle, link_middle);
        self.rotor.set(rotor_angle, rotor_middle, half);
        self.link.set(link_angle, link_middle, half);
    }

    /// Returns the conservative torques on the link plus the torque of the end stops.
    #[inline]
    fn link_torque(
        &self,
        config: &PlantConfig,
        (at, value, slope): (f64, f64, f64),
        angle: f64,
    ) -> f64 {
        let moved = angle - at;
        let mut torque = -(value + moved * (slope - 0.5 * moved * value));
        if let Some(spring) = &config.mechanism.spring {
            torque += spring.torque(angle);
        }
        if let Some(stops) = &config.mechanism.end_stops {
            torque += stops.torque(angle, self.link.speed);
        }
        torque
    }

    /// Returns the conservative torques on the rotor, joint-side.
    #[inline]
    fn rotor_torque(&self, config: &PlantConfig, angle: f64) -> f64 {
        let mut torque = 0.0;
        if let Some(cogging) = &config.motor.cogging {
            torque += self.ratio * cogging.torque(angle * self.ratio);
        }
        if let Some(eccentricity) = &config.mechanism.eccentricity {
            torque += eccentricity.torque(angle * self.ratio);
        }
        torque
    }

    /// Integrates winding and rotor-side mass together over one substep, with the implicit midpoint rule. Returns the
    /// speed in the middle and the electromagnetic torque.
    #[inline]
    fn kick(
        &mut self,
        config: &PlantConfig,
        held: &Held,
        angle: f64,
        speed: f64,
        inertia: f64,
        damping: f64,
        torque: f64,
    ) -> (f64, f64) {
        let mut constant = held.torque_constant;
        if let Some(ripple) = &config.motor.ripple {
            constant *= ripple.scale(angle * self.ratio);
        }
        if let Some(saturation) = &config.motor.saturation {
            constant *= saturation.scale(self.current);
        }
        let rate = inertia / (0.5 * self.dt);
        let moved = rate * speed + torque;
        if held.on {
            let lost = config
                .bridge
                .dead_time
                .map_or(0.0, |dead| dead.drop(self.current));
            let series = config.bridge.supply_resistance * held.duty * held.duty;
            let winding = self.winding(held, held.duty * held.supply - lost, series);
            let slope = constant * constant * winding.inverse;
            let middle =
                (moved + constant * winding.source * winding.inverse) / (rate + damping + slope);
            let current = (winding.source - constant * middle) * winding.inverse;
            self.current = 2.0 * current - self.current;
            self.voltage = winding.voltage - series * current;
            self.book_winding(
                held,
                held.supply * held.duty * current,
                lost * current + series * current * current,
                current,
            );
            return (middle, constant * current);
        }
        self.freewheel(config, held, constant, speed, rate + damping, moved)
    }

    /// Integrates with the bridge off: the current decays through the diodes into the supply, unless the back-EMF
    /// exceeds the supply and sustains it.
    #[cold]
    fn freewheel(
        &mut self,
        config: &PlantConfig,
        held: &Held,
        constant: f64,
        speed: f64,
        mass: f64,
        moved: f64,
    ) -> (f64, f64) {
        let diodes = 2.0 * config.bridge.diode_drop;
        let wall = held.supply + diodes;
        let emf = constant * speed;
        if self.current == 0.0 && emf.abs() <= wall {
            let middle = moved / mass;
            self.voltage = constant * middle;
            return (middle, 0.0);
        }
        let sign = if self.current == 0.0 {
            -emf.signum()
        } else {
            self.current.signum()
        };
        let series = config.bridge.supply_resistance;
        let winding = self.winding(held, -sign * wall, series);
        let slope = constant * constant * winding.inverse;
        let mut middle = (moved + constant * winding.source * winding.inverse) / (mass + slope);
        let mut current = (winding.source - constant * middle) * winding.inverse;
        let mut next = 2.0 * current - self.current;
        if next * sign < 0.0 {
            // The current reached zero within the substep: a triangle, then zero.
            current = 0.5 * self.current * self.current / (self.current - next);
            next = 0.0;
            middle = (moved + constant * current) / mass;
        }
        self.current = next;
        self.voltage = winding.voltage - series * current;
        self.book_winding(
            held,
            -held.supply * current.abs(),
            diodes * current.abs() + series * current * current,
            current,
        );
        (middle, constant * current)
    }

    #[inline]
    fn winding(&self, held: &Held, voltage: f64, series: f64) -> Winding {
        let store = 2.0 * self.inductance / self.dt;
        Winding {
            voltage,
            inverse: 1.0 / (store + held.resistance + series),
            source: store * self.current + voltage,
        }
    }

    #[inline]
    fn book_winding(&mut self, held: &Held, supply: f64, bridge: f64, current: f64) {
        let joule = held.resistance * current * current * self.dt;
        self.flows.supply += supply * self.dt;
        self.flows.bridge += bridge * self.dt;
        self.flows.joule += joule;
        self.heat.winding += joule;
    }

    #[inline]
    fn book(&mut self, friction: f64, external: f64) {
        self.flows.friction += friction * self.dt;
        self.heat.friction += friction * self.dt;
        self.flows.external += external * self.dt;
    }

    #[inline]
    fn book_stops(&mut self, config: &PlantConfig, angle: f64, middle: f64) {
        if let Some(stops) = &config.mechanism.end_stops
            && !(stops.range[0]..=stops.range[1]).contains(&angle)
        {
            let damped = stops.torque(angle, self.link.speed) - stops.torque(angle, 0.0);
            self.flows.contact -= damped * middle * self.dt;
        }
    }

    /// Returns the state as a report; the caller adds time and temperatures.
    pub(super) fn truth(
        &self,
        config: &PlantConfig,
        load_inertia: f64,
        (gc, gs): (f64, f64),
    ) -> Truth {
        let (s, c) = self.link.angle.sin_cos();
        let rotor = self.motor_angle();
        let mechanism = &config.mechanism;
        let potential = gc * s - gs * c
            + mechanism
                .spring
                .map_or(0.0, |spring| spring.energy(self.link.angle))
            + mechanism
                .eccentricity
                .map_or(0.0, |e| e.energy(rotor, self.ratio))
            + config
                .motor
                .cogging
                .map_or(0.0, |cogging| cogging.energy(rotor));
        let elastic = self
            .transmission
            .map_or(0.0, |t| t.energy(self.rotor.angle - self.link.angle))
            + mechanism
                .end_stops
                .map_or(0.0, |stops| stops.energy(self.link.angle));
        let kinetic = 0.5 * self.rotor_inertia * self.rotor.speed * self.rotor.speed
            + 0.5 * load_inertia * self.link.speed * self.link.speed;
        Truth {
            position: self.link.angle,
            velocity: self.link.speed,
            acceleration: self.acceleration,
            motor_position: rotor,
            motor_velocity: self.rotor.speed * self.ratio,
            current: self.current,
            voltage: self.voltage,
            supply: self.bus,
            drive_torque: self.drive_torque,
            friction_torque: self.friction_torque,
            transmitted_torque: self.transmitted,
            energy: Energy {
                magnetic: 0.5 * self.inductance * self.current * self.current,
                kinetic,
                potential,
                elastic,
                asperities: self.motor_contact.stored() + self.link_contact.stored(),
                ..self.flows
            },
            ..Truth::default()
        }
    }
}

#[inline]
fn react(
    contact: &mut Contact,
    friction: &Friction,
    speed: f64,
    dt: f64,
    coulomb: f64,
    transmitted: f64,
) -> Reaction {
    let load = friction.load.map_or(0.0, |load| load.torque(transmitted));
    contact.advance(speed, speed * dt, Scale { coulomb, load })
}

#[inline]
fn damping(friction: &Friction, held: &Held, reaction: Reaction, speed: f64) -> f64 {
    let drag = friction.drag.map_or(0.0, |drag| drag.viscous_at(speed));
    held.viscous_scale * friction.viscous + drag + reaction.damping
}
