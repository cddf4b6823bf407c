"""A dataset as a cell of a notebook.

The service's own viewer may not be framed by other pages, for it may hold a token. So the cell is a small page of its own, with the CesiumJS
that the service serves. It has no token: private datasets stay empty.
"""
from __future__ import annotations

import html
import json

_PAGE = """<!doctype html><meta charset="utf-8"><style>html,body,#map{margin:0;height:100%%}</style><div id="map"></div>
<script>window.CESIUM_BASE_URL=%(service)s+"/cesium/"</script><script src=%(script)s></script><script type="module">
const address=%(dataset)s;
const widget=new Cesium.CesiumWidget("map",{baseLayer:false,scene3DOnly:true,requestRenderMode:true});
const scene=widget.scene;
scene.globe.show=false;
const tileset=await Cesium.Cesium3DTileset.fromUrl(address+"/tileset.json",{maximumScreenSpaceError:2});
scene.primitives.add(tileset);
const {bounds:[west,south,east,north,low,high]}=await(await fetch(address+"/manifest.json")).json();
const sphere=Cesium.BoundingSphere.fromRectangle3D(Cesium.Rectangle.fromDegrees(west,south,east,north),Cesium.Ellipsoid.WGS84,(low+high)/2);
scene.camera.viewBoundingSphere(sphere,new Cesium.HeadingPitchRange(-0.42,-0.5,sphere.radius*1.8));
scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
const {directionWC:ahead,rightWC:right}=scene.camera;
scene.light=new Cesium.DirectionalLight({direction:Cesium.Cartesian3.normalize(Cesium.Cartesian3.add(ahead,right,new Cesium.Cartesian3()),new Cesium.Cartesian3())});
</script>"""


def _text(value: str) -> str:
    """A string of JavaScript that no end of a script can hide in."""
    return json.dumps(value).replace("<", "\\u003c")


class View:
    def __init__(self, service: str, dataset: str, height_px: int) -> None:
        self._service, self._dataset, self._height_px = service, dataset, height_px

    def page(self) -> str:
        return _PAGE % {"service": _text(self._service), "script": '"%s"' % html.escape(self._service + "/cesium/Cesium.js"), "dataset": _text(self._dataset)}

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.page())}" style="width:100%;height:{self._height_px:d}px;border:0" title="Terrain"></iframe>'
