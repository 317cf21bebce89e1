"""Draw the block diagrams of the docs: python docs/make_diagrams.py [FOLDER]

Equations as corrected. Signals flow from left to right, feedback runs below; the bold red line is the collision
detection signal. Words stay text in the SVG, formulas become outlines. The same script gives the same bytes; a drawing
above 60 kB is an error. A drawing is a function: its name is the file's, its docstring gives title and description.
"""

from __future__ import annotations

import inspect
import io
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import matplotlib as mpl
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.text import Text

IMAGES = Path(__file__).resolve().parent / "images"
LARGEST = 60_000
WIDTH_INCH = 8.0
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "cdtool",
    "mathtext.fontset": "cm",
    "font.family": "DejaVu Sans",
}
INK, SIGNAL, MODEL, PLAIN, FRAME = "#222222", "#a01515", "#e3eaf2", "#ffffff", "#777777"
LINE_HEIGHT, HEAD = 3.4, 1.5

Point = tuple[float, float]


@dataclass(frozen=True)
class Node:
    """Something that wires start or end at: centre and size in hundredths of the picture's width."""

    x: float
    y: float
    width: float
    height: float

    def edge_towards(self, other: Point) -> Point:
        """Where a wire from `other` meets the outline; raises ValueError where it would run askew."""
        x, y = other
        if abs(y - self.y) <= self.height / 2:
            return self.x + (self.width / 2 if x > self.x else -self.width / 2), y
        if abs(x - self.x) <= self.width / 2:
            return x, self.y + (self.height / 2 if y > self.y else -self.height / 2)
        raise ValueError(f"a wire from {other} meets {self} neither horizontally nor vertically")


class Formula(Text):
    """Text that becomes outlines, so that a formula needs no font where it is read."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw as outlines."""
        with mpl.rc_context({"svg.fonttype": "path"}):
            super().draw(renderer)


class Diagram:
    """A sheet 100 wide; each method draws one item of the vocabulary."""

    def __init__(self, height: float) -> None:
        self.figure = Figure(figsize=(WIDTH_INCH, WIDTH_INCH * height / 100), facecolor="white")
        self.axes = self.figure.add_axes((0, 0, 1, 1), xlim=(0, 100), ylim=(0, height), aspect="equal")
        self.axes.set_axis_off()

    def text(self, x: float, y: float, words: str, side: str = "center", color: str = INK) -> None:
        """One line at (x, y): a formula where it holds a $, else plain text; `side` is where the point lies."""
        kind, size = (Formula, 13) if "$" in words else (Text, 10)
        item = kind(x, y, words, fontsize=size, color=color, ha=side, va="center_baseline", zorder=4)
        self.axes.add_artist(item)

    def lines(self, x: float, y: float, words: str) -> None:
        """Lines of text, centred on (x, y)."""
        rows = words.split("\n")
        for i, row in enumerate(rows):
            self.text(x, y + LINE_HEIGHT * ((len(rows) - 1) / 2 - i), row)

    def block(self, x: float, y: float, words: str, width: float = 12, height: float = 8, fill: str = PLAIN) -> Node:
        """A rectangle; filled where it holds the machine's model."""
        corner = (x - width / 2, y - height / 2)
        self.axes.add_patch(Rectangle(corner, width, height, facecolor=fill, edgecolor=INK, linewidth=1.2, zorder=2))
        self.lines(x, y, words)
        return Node(x, y, width, height)

    def integrator(self, x: float, y: float) -> Node:
        """1/s."""
        return self.block(x, y, r"$\dfrac{1}{s}$", 7, 9)

    def gain(self, x: float, y: float, words: str) -> Node:
        """A triangle that points to the right."""
        corners = [(x - 4, y - 5), (x - 4, y + 5), (x + 4, y)]
        self.axes.add_patch(Polygon(corners, facecolor=PLAIN, edgecolor=INK, linewidth=1.2, zorder=2))
        self.text(x - 1.2, y, words)
        return Node(x, y, 8, 0)

    def sum(self, x: float, y: float, *, left: str = "+", top: str = "", bottom: str = "", inside: str = "") -> Node:
        """A circle with the sign of each input beside its arrow; `inside` makes it another operation."""
        self.axes.add_patch(Circle((x, y), 1.9, facecolor=PLAIN, edgecolor=INK, linewidth=1.2, zorder=2))
        self.text(x, y, inside)
        for sign, at in ((left, (x - 3.4, y + 1.7)), (top, (x + 1.7, y + 3.2)), (bottom, (x + 1.7, y - 3.4))):
            self.text(*at, sign.replace("-", "\N{MINUS SIGN}"))
        return Node(x, y, 3.8, 3.8)

    def port(self, x: float, y: float, words: str, width: float = 10) -> Node:
        """Words without a frame: where a signal comes from or goes to."""
        self.lines(x, y, words)
        return Node(x, y, width, LINE_HEIGHT * (1 + words.count("\n")))

    def frame(self, left: float, bottom: float, right: float, top: float, words: str) -> None:
        """A dashed outline around what belongs together, its name inside the upper edge."""
        size = (right - left, top - bottom)
        self.axes.add_patch(Rectangle((left, bottom), *size, fill=False, edgecolor=FRAME, linestyle="--", zorder=0))
        self.text(left + 1.2, top - 2.2, words, side="left", color="#555555")

    def wire(self, *items: Node | Point | str, leg: int = 0, along: float = 0.5, signal: bool = False) -> None:
        """Arrows from node to node, round the corners given as points; a string labels the arrow it stands in.

        One that starts at a point takes off from another wire there (a dot). The label is at the fraction `along` of
        leg number `leg`: above it where it is horizontal, else to its right.
        """
        stops: list[Node | Point] = []
        label = ""
        for item in items:
            if isinstance(item, str):
                label = item
                continue
            stops.append(item)
            if isinstance(item, Node) and len(stops) > 1:
                self._arrow(stops, label, leg, along, SIGNAL if signal else INK, 2.0 if signal else 1.2)
                stops, label = [item], ""

    def _arrow(self, stops: list[Node | Point], label: str, leg: int, along: float, color: str, weight: float) -> None:
        """One arrow through the stops, clipped at the nodes it joins."""
        points = [(stop.x, stop.y) if isinstance(stop, Node) else stop for stop in stops]
        if isinstance(stops[0], Node):
            points[0] = stops[0].edge_towards(points[1])
        else:
            self.axes.add_patch(Circle(stops[0], 0.55, facecolor=INK, edgecolor="none", zorder=3))
        if isinstance(stops[-1], Node):
            points[-1] = stops[-1].edge_towards(points[-2])
        (x0, y0), (x1, y1) = points[-2:]
        length = math.hypot(x1 - x0, y1 - y0)
        dx, dy = HEAD * (x1 - x0) / length, HEAD * (y1 - y0) / length
        head = [(x1, y1), (x1 - dx - 0.4 * dy, y1 - dy + 0.4 * dx), (x1 - dx + 0.4 * dy, y1 - dy - 0.4 * dx)]
        self.axes.add_patch(Polygon(head, facecolor=color, edgecolor="none", zorder=3))
        xs, ys = zip(*points[:-1], (x1 - dx, y1 - dy), strict=True)
        self.axes.plot(xs, ys, color=color, linewidth=weight, zorder=1, solid_joinstyle="miter", clip_on=False)
        (xa, ya), (xb, yb) = points[leg : leg + 2]
        x, y = xa + along * (xb - xa), ya + along * (yb - ya)
        if ya == yb:
            self.text(x, y + 2.0, label, color=color)
        else:
            self.text(x + 1.0, y, label, side="left", color=color)


DRAWINGS: dict[str, tuple[float, Callable[[Diagram], None]]] = {}


def drawing(height: float) -> Callable[[Callable[[Diagram], None]], None]:
    """Enter a function as a drawing of this height."""

    def enter(draw: Callable[[Diagram], None]) -> None:
        DRAWINGS[draw.__name__] = height, draw

    return enter


def decision(d: Diagram, detector: Node, label: str) -> None:
    """From the collision detection signal to the alarm: activation logic on its path, the signature below."""
    x, y = 65.5, detector.y
    signature = d.block(x, y - 19, "signature\nnormal band", 15)
    activation = d.block(x + 16.5, y, "activation\nlogic", 13)
    d.wire(detector, label, activation, along=0.25, signal=True)
    d.wire((x, y), "impact-free", signature)
    d.wire(signature, (x + 16.5, y - 19), r"$i_\mathrm{th}$", activation, leg=1)
    d.wire(activation, d.port(x + 31, y, "alarm", 6))


def observer(d: Diagram, known: str) -> tuple[Node, Node]:
    """What two observers share: the machine above; below it the loop between the torque balance and the comparison."""
    torque, machine, motion = d.port(5, 60, "torque", 8), d.block(50, 60, "machine", 20), d.port(94, 60, "motion", 9)
    balance, compare = d.sum(21, 26, top="-", bottom="-"), d.sum(70, 26, top="-")
    d.wire(torque, r"$\tau_J$", machine, r"$q,\ \dot q$", motion, along=0.65)
    d.wire(d.port(50, 73, "contact", 9), r"$\tau_c$", machine)
    d.wire((13, 60), (13, 26), balance)
    d.wire((70, 50), (38, 50), d.block(38, 41, known, 16, fill=MODEL), (21, 41), balance)
    gain = d.gain(81, 26, "$K$")
    d.wire(compare, gain)
    d.wire(gain, d.port(97, 26, "res", 4), signal=True)
    d.wire((89, 26), (89, 14), (21, 14), balance)
    return balance, compare


@drawing(46)
def structure(d: Diagram) -> None:
    """Structure of a collision detector.

    A collision is a fault of the process. Feature generation makes the collision detection signal i of the measured
    signals y and a machine model. Fault detection learns the threshold i_th from normal behaviour; its activation logic
    compares both and raises the alarm (thesis figure 2.1).
    """
    d.frame(33, 3, 53, 43, "feature generation")
    d.frame(55, 3, 90.5, 43, "fault detection")
    process, detector = d.block(20, 29, "process", 13, 10), d.block(43, 29, "detector", 14, 10)
    activation = d.block(80, 29, "activation\nlogic", 13, 10)
    threshold = d.block(67, 11, "threshold:\nnormal behaviour", 19)
    d.wire(d.port(20, 43, "faults: collision", 18), process)
    d.wire(d.port(5, 29, "inputs", 8), process, "$y$", detector, along=0.35)
    d.wire(d.block(43, 11, "machine\nmodel", 14, fill=MODEL), detector)
    d.wire(detector, "$i$", activation, signal=True, along=0.4)
    d.wire((67, 29), threshold)
    d.wire(threshold, (80, 11), r"$i_\mathrm{th}$", activation, leg=1)
    d.wire(activation, d.port(96, 29, "alarm", 6))


@drawing(76)
def velocity_observer(d: Diagram) -> None:
    """Velocity observer.

    The residual is K times the observed minus the measured speed, res = K (x_hat - qd), and is fed back into the
    balance d(x_hat)/dt = M^-1 (tau_J - n - res), n = C qd + g + tau_f (thesis figure 2.3, 2.12 and 2.13, corrected).
    """
    balance, compare = observer(d, r"$n(q,\dot q)$")
    inertia, integral = d.block(37, 26, r"$M^{-1}(q)$", 13, fill=MODEL), d.integrator(55, 26)
    d.wire(balance, inertia, r"$\dot{\hat x}$", integral, r"$\hat x$", compare)
    d.wire((70, 60), r"$\dot q$", compare, along=0.7)
    d.text(50, 8, r"$\dot{\hat x}=M^{-1}(\tau_J-n-\mathrm{res}),\quad \mathrm{res}=K(\hat x-\dot q)$")
    d.text(50, 3, r"$n=C\dot q+g+\tau_f,\quad \hat x(0)=\dot q(0)$")


@drawing(76)
def momentum_observer(d: Diagram) -> None:
    """Momentum observer.

    The residual is K times the observed minus the measured momentum, res = K (p_hat - p) with p = M qd, and is fed back
    into the balance d(p_hat)/dt = tau_J - beta - res with beta = g - C' qd + tau_f. So res follows the contact torque
    tau_c through the low-pass K / (s + K) (thesis figure 2.4, 2.16 to 2.21, corrected).
    """
    balance, compare = observer(d, r"$\beta(q,\dot q)$")
    d.wire(balance, r"$\dot{\hat p}$", d.integrator(46, 26), r"$\hat p$", compare)
    d.wire((70, 60), d.block(70, 40, r"$M(q)\,\dot q$", 13, fill=MODEL), "$p$", compare, along=0.4)
    d.text(50, 8, r"$\dot{\hat p}=\tau_J-\beta-\mathrm{res},\quad \mathrm{res}=K(\hat p-p)$")
    d.text(50, 3, r"$\beta=g-C^T\dot q+\tau_f,\quad \hat p(0)=p(0)$")


@drawing(71)
def friction_ekf(d: Diagram) -> None:
    """Friction-estimating extended Kalman filter.

    Predict with the drive force F, all from the old state: d stays, a = (F - d v) / m, v = v + T a. Update with the
    measured acceleration, then with the measured speed. The activation logic compares the estimated friction d_hat
    with the signature learned from impact-free runs, and raises the alarm (thesis figure 5.5, 5.5 to 5.8, corrected).
    """
    d.frame(17, 20, 54, 56, "extended Kalman filter")
    predict, update, delay = d.block(26, 44, "predict"), d.block(45, 44, "update"), d.block(35.5, 27, "$z^{-1}$", 9)
    d.wire(d.port(6.5, 44, "torque", 9), "$F$", predict, along=0.3)
    d.wire(d.port(6.5, 67, "acceleration", 12), (48, 67), "$a$", update)
    d.wire(d.port(6.5, 61, "speed", 9), (42, 61), "$v$", update)
    d.wire(predict, update, (45, 27), delay)
    d.wire(delay, (26, 27), r"$\hat d,\,\hat a,\,\hat v$", predict, leg=1)
    decision(d, update, r"$\hat d$")
    d.text(50, 12, r"$\hat d^-=\hat d,\quad \hat a^-=(F-\hat d\,\hat v)/m,\quad \hat v^-=\hat v+T\hat a$")
    d.text(50, 5, "not applicable below a minimum speed: friction cannot be observed at rest")


@drawing(66)
def inertial_momentum(d: Diagram) -> None:
    """Inertial momentum observer.

    A complementary filter adds the load's acceleration times s / (s^2 + k1 s + k2) and the speed times
    (k1 s + k2) / (s^2 + k1 s + k2). The momentum observer takes this speed v_hat and the torque; its residual is
    compared with the signature, which raises the alarm (thesis figure 6.2, 6.5, corrected).
    """
    d.frame(16.6, 30, 44, 64, "complementary filter")
    slow = d.block(26.8, 37, r"$\dfrac{k_1s+k_2}{s^2+k_1s+k_2}$", 17, 10)
    fast = d.block(26.8, 53, r"$\dfrac{s}{s^2+k_1s+k_2}$", 17, 10)
    add, momentum = d.sum(41, 37, top="+"), d.block(54, 37, "momentum\nobserver", 13, 9)
    d.wire(d.port(6.5, 53, "acceleration", 12), "$a$", fast, (41, 53), add, along=0.3)
    d.wire(d.port(6.5, 37, "speed", 9), "$v$", slow, add, along=0.35)
    d.wire(add, r"$\hat v$", momentum, along=0.6)
    d.wire(d.port(6.5, 22, "torque", 9), "$F$", (54, 22), momentum, along=0.1)
    decision(d, momentum, r"$\mathrm{res}$")
    d.text(50, 5, r"$\hat v=\dfrac{s}{s^2+k_1s+k_2}\,a+\dfrac{k_1s+k_2}{s^2+k_1s+k_2}\,v$")


@drawing(62)
def energy_observer(d: Diagram) -> None:
    """Energy observer.

    res = k [ integral of (qd' (tau_J - tau_f) - res) dt - (E - E(0)) ], E = 1/2 qd' M qd + U(q). The residual tends to
    the power qd' tau_c of the contact, which is nothing at rest (thesis 2.9 and 2.10, corrected).
    """
    net, power = d.sum(19, 29, top="-"), d.sum(32, 29, left="", inside=r"$\times$")
    balance, compare, gain = d.sum(45, 29, bottom="-"), d.sum(71, 29, top="-"), d.gain(82, 29, "$k$")
    d.wire(d.port(5, 29, "torque", 8), r"$\tau_J$", net, power, "$P$", balance, along=0.35)
    d.wire(balance, d.integrator(57, 29), compare, gain)
    energy = d.block(71, 43, "$E-E(0)$", 15, fill=MODEL)
    d.wire(d.port(5, 57, "motion", 8), r"$q,\ \dot q$", (71, 57), energy, compare, along=0.25)
    d.wire((19, 57), d.block(19, 43, r"$\tau_f$", 9, fill=MODEL), net)
    d.wire((32, 57), r"$\dot q$", power)
    d.wire(gain, d.port(97, 29, "res", 4), signal=True)
    d.wire((90, 29), (90, 17), (45, 17), balance)
    d.text(50, 9, r"$\mathrm{res}=k\,[\,\int\ (\dot q^T(\tau_J-\tau_f)-\mathrm{res})\,dt-(E-E(0))\,]$")
    d.text(50, 3, r"$E=\frac{1}{2}\,\dot q^TM\dot q+U(q)$")


@drawing(57)
def direct(d: Diagram) -> None:
    """Direct estimation.

    res = F(s) {tau_J - n} - M F(s) {s qd}: torque, model torque n = C qd + g + tau_f and acceleration all pass the same
    low-pass F(s), so that none is later than the others; s F(s) derives the speed inside the filter.
    """
    d.frame(38, 10, 58, 55, "same low-pass")
    torque, model, speed = (d.block(48, y, words) for y, words in ((45, "$F(s)$"), (31, "$F(s)$"), (17, r"$s\,F(s)$")))
    total = d.sum(80, 31, left="-", top="+", bottom="-")
    d.wire(d.port(5, 45, "torque", 8), r"$\tau_J$", torque, (80, 45), total, along=0.2)
    dynamics, inertia = d.block(28, 31, r"$n(q,\dot q)$", 13, fill=MODEL), d.block(67, 17, "$M(q)$", 10, fill=MODEL)
    d.wire(d.port(5, 31, "motion", 8), r"$q,\ \dot q$", dynamics, model, total, along=0.4)
    d.wire((17, 31), (17, 17), r"$\dot q$", speed, leg=1, along=0.2)
    d.wire(speed, inertia, (80, 17), total)
    d.wire(total, d.port(96, 31, "res", 4), signal=True)
    d.text(50, 4, r"$\mathrm{res}=F\{\tau_J-n\}-M\,F\{s\,\dot q\},\quad n=C\dot q+g+\tau_f$")


@drawing(58)
def desired_dynamics(d: Diagram) -> None:
    """Desired dynamics.

    The model torque is computed from the reference, M(q_r) qdd_r + n(q_r, qd_r), passes the same low-pass F(s) as the
    torque and is taken from it. Beside it the tracking error q_r - q is checked, sample by sample: above its limit the
    model torque is not that of the motion made, and the residual is not applicable.
    """
    derive, model = d.block(24, 34, "derivatives\n(causal)", 13), d.block(48, 34, "model\ntorque", 10, fill=MODEL)
    error, total = d.sum(24, 16, left="-", top="+"), d.sum(74, 34, left="-", top="+")
    low_pass, valid = d.block(62, 34, "$F(s)$", 10), d.block(85, 34, "valid?", 10)
    check = d.block(54, 16, "tracking error\nwithin its limit?", 25)
    d.wire(d.port(6, 51, "torque", 8), r"$\tau_J$", d.block(62, 51, "$F(s)$", 10), (74, 51), total, along=0.1)
    d.wire(d.port(6, 34, "reference", 10), derive, r"$q_r,\,\dot q_r,\,\ddot q_r$", model, low_pass, total, valid)
    d.wire(d.port(6, 16, "position", 10), "$q$", error, "$e$", check, (85, 16), valid)
    d.wire((14, 34), (14, 25), "$q_r$", (24, 25), error, leg=1)
    d.wire(valid, d.port(97, 34, "res", 4), signal=True)
    d.text(50, 4, r"$\mathrm{res}=F\{\tau_J-M(q_r)\,\ddot q_r-n(q_r,\dot q_r)\},\quad e=q_r-q$")


@drawing(73)
def kalman_momentum(d: Diagram) -> None:
    """Kalman filter on the momentum.

    State x = (p, tau_c). Predict with u = tau_J - beta: p = p + T (u - tau_c), tau_c stays. Update with the measured
    momentum p = M qd: the innovation p - p_hat, times the Kalman gain L, corrects the state. The residual is tau_c_hat.
    """
    net, predict, second = d.sum(19, 30, top="-"), d.block(33, 30, "predict"), d.block(88, 30, r"$[0\ \ 1]$", 8, 6)
    innovation, add = d.sum(57, 47, left="-", top="+"), d.sum(75, 30, top="+")
    momentum, first = d.block(57, 59, r"$M(q)\,\dot q$", 13, fill=MODEL), d.block(45, 38, r"$[1\ \ 0]$", 8, 6)
    d.wire(d.port(5, 30, "torque", 8), r"$\tau_J$", net, "$u$", predict, r"$\hat x^-$", add, along=0.35)
    d.wire(d.port(5, 69, "motion", 8), r"$q,\ \dot q$", (57, 69), momentum, "$p$", innovation, along=0.4)
    d.wire((19, 69), d.block(19, 48, r"$\beta(q,\dot q)$", 13, fill=MODEL), net)
    d.wire((45, 30), first, (45, 47), innovation, d.gain(67, 47, "$L$"), (75, 47), add)
    d.wire(add, r"$\hat x$", second, along=0.4)
    d.wire((81, 30), (81, 18), d.block(56, 18, "$z^{-1}$", 9, 7), (33, 18), predict)
    d.wire(second, d.port(97.5, 30, "res", 4), signal=True)
    d.text(50, 9, r"$\hat p^-=\hat p+T(u-\hat\tau_c),\quad \hat\tau_c^-=\hat\tau_c,\quad u=\tau_J-\beta$")
    d.text(50, 3, r"$\hat x=(\hat p,\hat\tau_c)=\hat x^-+L(p-\hat p^-),\quad \mathrm{res}=\hat\tau_c$")


def diagram(name: str) -> Diagram:
    """One drawing."""
    height, draw = DRAWINGS[name]
    sheet = Diagram(height)
    draw(sheet)
    return sheet


def svg(name: str) -> str:
    """One drawing as a file's text, with a title and a description for those who do not see it."""
    title, _, description = (inspect.getdoc(DRAWINGS[name][1]) or "").partition("\n\n")
    title = title.removesuffix(".")
    file = io.StringIO()
    with mpl.rc_context(STYLE):
        diagram(name).figure.savefig(file, format="svg", metadata={"Title": title, "Date": None, "Creator": None})
    return file.getvalue().replace("</title>", f"</title>\n <desc>{escape(description)}</desc>", 1)


def main(folder: Path) -> int:
    """Write every drawing; 1 where one is too large."""
    folder.mkdir(exist_ok=True)
    for name in DRAWINGS:
        (folder / f"{name}.svg").write_text(svg(name), encoding="utf-8", newline="\n")
    large = [path for path in sorted(folder.glob("*.svg")) if path.stat().st_size > LARGEST]
    for path in large:
        print(f"{path.name}: {path.stat().st_size} bytes, more than {LARGEST}")
    return 1 if large else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES))
