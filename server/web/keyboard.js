// The camera by keys, while the globe has the focus. Steps grow with the height above the ground.
const kTurn_rad = 0.05;
const kMoveShare = 0.06, kZoomShare = 0.2;

export function steer_by_keys(element, camera, go_home, take_middle) {
  const height = () => Math.max(Math.abs(camera.positionCartographic.height), 20);
  const move = (share) => height() * share;
  const keys = {
    ArrowUp: () => camera.moveUp(move(kMoveShare)), ArrowDown: () => camera.moveDown(move(kMoveShare)),
    ArrowLeft: () => camera.moveLeft(move(kMoveShare)), ArrowRight: () => camera.moveRight(move(kMoveShare)),
    "+": () => camera.moveForward(move(kZoomShare)), "=": () => camera.moveForward(move(kZoomShare)),
    "-": () => camera.moveBackward(move(kZoomShare)),
    PageUp: () => camera.lookUp(kTurn_rad), PageDown: () => camera.lookDown(kTurn_rad),
    "[": () => camera.lookLeft(kTurn_rad), "]": () => camera.lookRight(kTurn_rad),
    Home: go_home, Enter: take_middle,
  };
  element.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
}
