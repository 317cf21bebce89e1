"""Draw all block diagrams of the docs, those of impacts too: python docs/make_impact_diagrams.py [FOLDER]

The vocabulary is that of make_diagrams.py; here are the thesis's figures 4.2, 4.5, 4.6 and 4.8, equations as corrected.
"""

from __future__ import annotations

import sys
from pathlib import Path

from make_diagrams import IMAGES, MODEL, Diagram, Node, drawing, main


def contact(d: Diagram, x: float, y: float) -> Node:
    """The contact: from penetration to force."""
    return d.block(x, y, r"$F_c(\delta,\dot\delta)$", 16, 8, fill=MODEL)


@drawing(72)
def impact_rigid(d: Diagram) -> None:
    """Impact behind a rigid transmission.

    Above, before the contact: the motor torque drives G = 1 / (J_t s^2 + d_t s), and the motor angle times r is the
    position of the load. Below, during the contact: the penetration delta = r theta_delta gives the contact force F_c,
    which goes back, times r, against the motor torque (thesis figures 4.2 b and c; 4.6 to 4.15).
    """
    d.frame(1, 47, 99, 71, "before the contact")
    d.frame(1, 2, 99, 44, "during the contact")
    free, ratio = d.block(47, 57, r"$\dfrac{1}{J_t s^2+d_t s}$", 20, 10), d.gain(73, 57, "$r$")
    d.wire(d.port(10, 57, "torque", 8), r"$\tau_m$", free, r"$\theta_m$", ratio, along=0.55)
    d.wire(ratio, "$x_l$", d.port(94, 57, "load", 6))
    total, plant = d.sum(26, 32, bottom="-"), d.block(47, 32, r"$\dfrac{1}{J_t s^2+d_t s}$", 20, 10)
    ratio, law, back = d.gain(73, 32, "$r$"), contact(d, 62, 10), d.block(40, 10, "$r$", 7, 7)
    d.wire(d.port(10, 32, "torque", 8), r"$\tau_m$", total, plant, r"$\theta_\delta$", ratio, along=0.55)
    d.wire(ratio, r"$\delta$", d.port(94, 32, "load", 6), along=0.8)
    d.wire((82, 32), (82, 10), law)
    d.wire(law, "$F_c$", back, (26, 10), total)


@drawing(76)
def impact_elastic(d: Diagram) -> None:
    """Impact behind an elastic transmission.

    Motor and load are two bodies, joined by tau_el = (k_el + d_el s) (theta_m - x_l/r). The contact force F_c acts on
    the load alone; the motor feels it only through tau_el. Before the contact F_c is nothing (thesis figure 4.5; 4.21
    to 4.26, corrected: F_c without a factor r, the friction d_l of the load added).
    """
    balance, motor = d.sum(20, 58, top="-"), d.block(38, 58, r"$\dfrac{1}{J_m s^2+d_m s}$", 19, 10)
    twist, spring = d.sum(58, 58, bottom="-"), d.block(76, 58, r"$k_{el}+d_{el}s$", 17, 8)
    d.wire(d.port(6, 58, "torque", 8), r"$\tau_m$", balance, motor, r"$\theta_m$", twist, spring, along=0.4)
    d.wire(spring, (94, 58), (94, 71), r"$\tau_{el}$", (20, 71), balance, leg=2)
    ratio, total = d.block(83, 30, r"$\dfrac{1}{r}$", 8, 9), d.sum(66, 30, left="", bottom="-")
    d.text(69.4, 31.7, "+")
    load = d.block(47, 30, r"$\dfrac{1}{M_l s^2+d_l s}$", 19, 10)
    d.wire((94, 58), (94, 30), ratio, total, load)
    unit = d.block(45, 44, r"$\dfrac{1}{r}$", 8, 9)
    d.wire(load, "$x_l$", (26, 30), (26, 44), unit, along=0.7)
    d.wire(unit, (58, 44), twist)
    law, origin = contact(d, 50, 10), d.sum(26, 10, left="-", top="+")
    d.wire((26, 30), origin, r"$\delta$", law, along=0.35)
    d.wire(d.port(6, 10, "obstacle", 9), "$x_o$", origin)
    d.wire(law, "$F_c$", (66, 10), total)


@drawing(44)
def impact_momentum(d: Diagram) -> None:
    """What the motor senses of an impact.

    The momentum that the load brings makes the penetration delta through G_c; the motor angle follows it through G_d,
    a low-pass with the resonance of the motor on the transmission (thesis figure 4.6; 4.27 to 4.30, corrected).
    """
    load, motor = d.block(40, 34, r"$G_{c\delta}(s)$", 15, 9), d.block(70, 34, r"$G_{\delta\theta}(s)$", 15, 9)
    d.wire(d.port(9, 34, "momentum\nof the load", 15), r"$M_l\,\dot x_l$", load, r"$\delta$", motor, along=0.5)
    d.wire(motor, r"$\theta_\delta$", d.port(94, 34, "motor", 7))
    d.text(50, 20, r"$G_{c\delta}=\dfrac{J_m s^2+d_t s+k_{el}}{a_4s^4+a_3s^3+a_2s^2+a_1s+a_0}$")
    d.text(50, 7, r"$G_{\delta\theta}=\dfrac{1}{r}\,\dfrac{d_{el}s+k_{el}}{J_m s^2+d_t s+k_{el}},\quad d_t=d_m+d_{el}$")


@drawing(56)
def impact_control(d: Diagram) -> None:
    """Impact under speed control.

    The regulator R = K_P + K_I/s + K_D s/(T_f s + 1) makes the control action u of the speed error, the actuator
    A = mu_a/(tau_a s + 1) the motor torque. The contact force F_c acts, times r, against it on the machine
    G = 1 / (J_t s + d_t). So tau_m/F_c is r L/(1 + L) with L = G R A, and u/F_c is that over A (thesis figure 4.8; 4.37
    to 4.39, corrected).
    """
    error, regulator, actuator = d.sum(17, 34, bottom="-"), d.block(30, 34, "$R(s)$", 11), d.block(48, 34, "$A(s)$", 11)
    total, machine = d.sum(64, 34, top="-"), d.block(79, 34, r"$\dfrac{1}{J_t s+d_t}$", 14, 10)
    d.wire(d.port(5, 34, "speed\nreference", 9), error, regulator, "$u$", actuator, r"$\tau_m$", total, machine)
    d.wire(d.port(36, 48, "contact force", 13), "$F_c$", d.block(52, 48, "$r$", 7, 7), (64, 48), total)
    d.wire(machine, r"$\dot\theta_m$", d.port(96.5, 34, "speed", 6), along=0.6)
    d.wire((89, 34), (89, 20), (17, 20), error)
    loop = r"\dfrac{L}{1+L},\quad L=\dfrac{R\,A}{J_t s+d_t}"
    d.text(50, 8, r"$\dfrac{\tau_m}{F_c}=\dfrac{r\,L}{1+L},\quad \dfrac{u}{F_c}=\dfrac{r}{A}\," + loop + "$")


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES))
