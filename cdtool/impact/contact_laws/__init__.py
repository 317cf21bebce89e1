"""Contact laws: from penetration and its rate to the force between two bodies. One file per law."""

from __future__ import annotations

from cdtool.base.registry import Registry

CONTACT_LAWS = Registry(
    kind="contact_law",
    table={
        "hertz": "cdtool.impact.contact_laws.hertz:Hertz",
        "kelvin_voigt": "cdtool.impact.contact_laws.kelvin_voigt:KelvinVoigt",
        "hysteresis_damping": "cdtool.impact.contact_laws.hysteresis_damping:HysteresisDamping",
        "hunt_crossley": "cdtool.impact.contact_laws.hunt_crossley:HuntCrossley",
        "lankarani_nikravesh": "cdtool.impact.contact_laws.lankarani_nikravesh:LankaraniNikravesh",
    },
    contract=("name", "title", "source", "force"),
)
