// Pictures on tiles, at the tiles' rims. With several samples a pixel, one of them may be inside of a tile where the pixel's middle is not. CesiumJS
// then looks for the picture a little beyond the rim, where it says there is none: a dotted line in the colour of bare tiles.
const { Cartesian4, ImageryPipelineStage } = window.Cesium;

// A rectangle of a tile's texture coordinates that a picture covers (west, south, east, north). Where it ends with the tile it goes on beyond it.
export function beyond_the_rim({ x, y, z, w }) {
  const kRounded = 1e-4;
  return new Cartesian4(x > kRounded ? x : -1, y > kRounded ? y : -1, z < 1 - kRounded ? z : 2, w < 1 - kRounded ? w : 2);
}

// The class is one that CesiumJS does not document. Without it there is nothing to be put right here.
export function mend_rims() {
  if (!ImageryPipelineStage?._createImageryUniforms) return;
  const made = ImageryPipelineStage._createImageryUniforms;
  ImageryPipelineStage._createImageryUniforms = (inputs) => {
    const uniforms = made.call(ImageryPipelineStage, inputs);
    uniforms.imageryTextureCoordinateRectangle = uniforms.imageryTextureCoordinateRectangle.map(beyond_the_rim);
    return uniforms;
  };
}
