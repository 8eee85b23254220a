"""Mistakes that type checkers find: one on each line that ends in `# error`, none elsewhere."""

import greensward as gs

gs.Camera(position_m=(0, 1))  # error
gs.Camera(position_m="here")  # error
gs.Camera(fov_y_deg="wide")  # error
gs.Camera(positon_m=(0, 1, 8))  # error
gs.Grass(height_m=0.3)  # error
gs.Grass(species=7)  # error
gs.Grass(shape="hexagon")  # error
gs.Scene(grass=gs.Grass())  # error
gs.Scene(grass=[gs.Grass(), "fescue"])  # error
gs.Scene(ground=gs.winds.Gusts())  # error
gs.Scene(wind=[gs.objects.Box(position_m=(0, 0, 0))])  # error
gs.Sowing(density_map=3)  # error
gs.Strong()  # error
gs.winds.Strong(power=4)  # error
gs.objects.Sphere()  # error
gs.objects.Mesh(position_m=(0, 0, 0))  # error
gs.forces.Tracks(path=[0, 1])  # error
gs.grounds.NoiseGround(octaves=2.5)  # error
gs.grounds.HeightMapGround(file=b"hills.png")  # error
gs.load(7)  # error
gs.load("meadow", seeds=2)  # error
gs.Renderer(7)  # error
gs.Renderer("meadow", size="1280x720")  # error
gs.Renderer("meadow").render(aovs=["blade-id"])  # error
print(gs.Renderer("meadow").render(aovs=("depth",)).picture)  # error
print(gs.SurfaceClass.TREE)  # error
wide: str = gs.Camera().fov_y_deg  # error
pair: tuple[float, float] = gs.Camera().position_m  # error
print(gs.Camera(position_m=(0, 1, 8)).position_m)
