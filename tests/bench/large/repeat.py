#!/usr/bin/env python3
"""A raster larger than memory that costs nothing: real terrain, repeated by a VRT: repeat.py SOURCE.tif SIDE OUT.vrt

SIDE x SIDE pixels of one arc second, in degrees, from 8 E 20 N. Only the pixels are real, not where they lie; where two copies
meet there is a step, which costs triangles as a cliff would."""
import json
import os
import subprocess
import sys


def copies(side, width, height):
    for row in range(0, side, height):
        for column in range(0, side, width):
            yield column, row, min(width, side - column), min(height, side - row)


def main():
    source, side, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    about = json.loads(subprocess.run(["gdalinfo", "-json", source], check=True, stdout=subprocess.PIPE).stdout)
    width, height = about["size"]
    nodata = about["bands"][0].get("noDataValue")
    with open(out, "w", encoding="utf-8") as vrt:
        vrt.write(f'<VRTDataset rasterXSize="{side}" rasterYSize="{side}"><SRS>EPSG:4326</SRS>\n')
        vrt.write(f"<GeoTransform>8, {1 / 3600!r}, 0, {20 + side / 3600!r}, 0, {-1 / 3600!r}</GeoTransform>\n")
        vrt.write(f'<VRTRasterBand dataType="Float32" band="1">{"" if nodata is None else f"<NoDataValue>{nodata}</NoDataValue>"}\n')
        for column, row, columns, rows in copies(side, width, height):
            vrt.write(f'<SimpleSource><SourceFilename relativeToVRT="0" shared="1">{os.path.abspath(source)}</SourceFilename><SourceBand>1</SourceBand>'
                      f'<SrcRect xOff="0" yOff="0" xSize="{columns}" ySize="{rows}"/>'
                      f'<DstRect xOff="{column}" yOff="{row}" xSize="{columns}" ySize="{rows}"/></SimpleSource>\n')
        vrt.write("</VRTRasterBand></VRTDataset>\n")


if __name__ == "__main__":
    main()
