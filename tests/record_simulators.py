"""Record the simulators' outputs in tests/data: a street corner of SUMO, a corridor of JuPedSim.

`make simulators` runs it where both are installed; they are no dependency of the project.
"""

import random
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import jupedsim
import shapely

ARMS = {"e": (60, 0), "w": (-60, 0), "n": (0, 60), "s": (0, -60)}


def write_corner(folder: Path) -> None:
    """Write a crossing with traffic lights and pavements, and 60 people who cross it."""
    nodes = "".join(f'<node id="{arm}" x="{x}" y="{y}"/>' for arm, (x, y) in ARMS.items())
    centre = '<node id="c" x="0" y="0" type="traffic_light"/>'
    (folder / "corner.nod.xml").write_text(f"<nodes>{centre}{nodes}</nodes>")
    edges = "".join(
        f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="1" sidewalkWidth="3"/>'
        for arm in ARMS
        for a, b in ((arm, "c"), ("c", arm))
    )
    (folder / "corner.edg.xml").write_text(f"<edges>{edges}</edges>")
    draw, people = random.Random(1), []
    for number in range(60):
        begin, end = draw.sample(sorted(ARMS), 2)
        position, arrival = draw.uniform(30, 48), draw.uniform(8, 20)
        people.append(
            f'<person id="ped{number}" depart="{number * 0.25}" departPos="{position:.1f}">'
            f'<walk from="{begin}c" to="c{end}" arrivalPos="{arrival:.1f}"/></person>'
        )
    (folder / "corner.rou.xml").write_text(f"<routes>{''.join(people)}</routes>")


def record_corner(output: Path) -> None:
    """Run SUMO with its own programs, and keep the places of its people."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        write_corner(folder)
        network = "-n corner.nod.xml -e corner.edg.xml -o corner.net.xml".split()
        subprocess.run(
            ["netconvert", *network, "--crossings.guess", "--walkingareas"], cwd=folder, check=True
        )
        options = "-n corner.net.xml -r corner.rou.xml --step-length 0.5 --end 60".split()
        options += "--fcd-output corner.xml --fcd-output.attributes x,y,angle,speed".split()
        subprocess.run(["sumo", *options, "--no-step-log"], cwd=folder, check=True)
        lines = (folder / "corner.xml").read_text().splitlines()
        body = next(number for number, line in enumerate(lines) if "<fcd-export" in line)
        output.write_text("\n".join(line.strip() for line in lines[body:]) + "\n")


def record_corridor(output: Path) -> None:
    """Run JuPedSim: 12 people walk one way along a corridor, and 6 the other."""
    output.unlink(missing_ok=True)
    simulation = jupedsim.Simulation(
        model=jupedsim.CollisionFreeSpeedModel(),
        geometry=[(0, 0), (24, 0), (24, 4), (0, 4)],
        dt=0.05,
        trajectory_writer=jupedsim.SqliteTrajectoryWriter(output_file=output, every_nth_frame=4),
    )
    for begin, end, count, speed in ((2, 23, 12, 1.2), (15, 0, 6, 1.0)):
        corners = [(end, 0), (end + 1, 0), (end + 1, 4), (end, 4)]
        stage = simulation.add_exit_stage(corners)
        journey = simulation.add_journey(jupedsim.JourneyDescription([stage]))
        for position in jupedsim.distribute_by_number(
            polygon=shapely.box(begin, 0.3, begin + 7, 3.7),
            number_of_agents=count,
            distance_to_agents=0.7,
            distance_to_polygon=0.3,
            seed=count,
        ):
            simulation.add_agent(
                jupedsim.CollisionFreeSpeedModelAgentParameters(
                    journey_id=journey,
                    stage_id=stage,
                    position=position,
                    desired_speed=speed,
                    radius=0.2,
                )
            )
    while simulation.agent_count() and simulation.iteration_count() < 1200:
        simulation.iterate()


if __name__ == "__main__":
    data = Path(__file__).parent / "data"
    data.mkdir(exist_ok=True)
    record_corner(data / "sumo_corner.xml")
    record_corridor(data / "jupedsim_corridor.sqlite")
