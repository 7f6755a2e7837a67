"""LAMMPS: pair energies and forces on a face-centred cubic lattice, 18 neighbours within 1.5 d.

usage: lammps_pairs.py STYLE in-hand|rebuilt SKIN CELLS EVALUATIONS

STYLE is a pair style (lj/cut, lj/cut/opt); SKIN is in nearest-neighbour distances; the lattice has CELLS^3
unit cells of 4 atoms and free sides, as atomesh's has. No atom moves: every step is one evaluation of the
energy and all forces. LAMMPS is under the GPL: it is run here and never linked.
"""

import sys

from job import Stopwatch, finish
from lammps import lammps

style, lists, skin, cells, evaluations = sys.argv[1:]
cells = int(cells)
program = lammps(cmdargs=["-screen", "none", "-log", "none"])
every = "once yes" if lists == "in-hand" else "every 1 delay 0 check no"
# density sqrt(2) puts nearest neighbours 1 apart; sites on the far sides would make another layer
program.commands_string(f"""
units lj
atom_style atomic
boundary s s s
lattice fcc {2**0.5:.17g}
region box block 0 {cells - 0.1} 0 {cells - 0.1} 0 {cells - 0.1}
create_box 1 box
create_atoms 1 box
mass 1 1
pair_style {style} 1.5
pair_coeff 1 1 1 {2 ** (-1 / 6):.17g}
neighbor {skin} bin
neigh_modify {every}
thermo_style custom step pe
thermo_modify norm no
thermo 1
run 1 post no
""")
with Stopwatch() as clock:
    program.command(f"run {evaluations} pre no post no")
finish(clock, atoms=program.get_natoms(), evaluations=int(evaluations),
       energy=program.get_thermo("pe"), version=str(program.version()))
