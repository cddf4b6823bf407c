#!/usr/bin/env python3
"""One-degree cells of a global 30 m elevation model as extents without pixels, to plan a planet: cells.py FOLDER [COUNT]

Writes COUNT rasters of the layout of Copernicus GLO-30 (26450 of them: 3600 rows a degree; columns thin out towards the poles) as VRTs
that hold nothing, and FOLDER/list.txt, which `cordillera plan` takes. Cells are where land is, by row: how many, after the share of land
of each ten degrees of latitude; which, in three runs, as if there were three continents. A plan depends on no more than that."""
import os
import sys

# Share of land by ten degrees of latitude, from the south pole.
LAND = [1.00, 0.90, 0.08, 0.01, 0.03, 0.11, 0.23, 0.22, 0.24, 0.23, 0.26, 0.38, 0.43, 0.53, 0.57, 0.71, 0.29, 0.05]
COLUMNS = [(50, 3600), (60, 2400), (70, 1800), (80, 1200), (85, 720), (90, 360)]  # up to this latitude
RUNS = [(-170, 0.35), (-20, 0.40), (90, 0.25)]  # western end, share of the row's cells

VRT = """<VRTDataset rasterXSize="{columns}" rasterYSize="3600">
  <SRS>EPSG:4326</SRS>
  <GeoTransform>{west}, {dx!r}, 0, {north}, 0, {dy!r}</GeoTransform>
  <VRTRasterBand dataType="Float32" band="1"><NoDataValue>-32767</NoDataValue></VRTRasterBand>
</VRTDataset>
"""


def cells(count):
    """(south, west) of each."""
    rows = [(south, LAND[(south + 90) // 10]) for south in range(-90, 90)]
    total = sum(share for _, share in rows)
    chosen, owed = [], 0.0
    for south, share in rows:
        owed += count * share / total
        here = min(360, round(owed) - len(chosen))
        columns = []
        for start, part in RUNS:
            columns += [west for west in range(start, start + round(here * part))]
        seen = list(dict.fromkeys((west + 180) % 360 - 180 for west in columns))
        spare = (west for west in range(-180, 180) if west not in set(seen))
        while len(seen) < here:
            seen.append(next(spare))
        chosen += [(south, west) for west in sorted(seen[:here])]
    return chosen[:count]


def main():
    folder, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 26450
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "list.txt"), "w", encoding="utf-8") as out:
        for south, west in cells(count):
            name = f"{'NS'[south < 0]}{abs(south):02}{'EW'[west < 0]}{abs(west):03}.vrt"
            farthest = max(abs(south), abs(south + 1))
            columns = next(n for up_to, n in COLUMNS if farthest <= up_to)
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(VRT.format(columns=columns, west=west, north=south + 1, dx=1 / columns, dy=-1 / 3600))
            out.write(f"{os.path.abspath(os.path.join(folder, name))}\n")


if __name__ == "__main__":
    main()
