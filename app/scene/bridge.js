/*
 * Between the 3D client and the page around it: runs in the client's document before the client does.
 *
 * The client talks to its server by a worker. What passes there is read here (link, clicks, camera, rotor), and what this
 * view alone is to show (camera, selection, ghosts, nose) is put in as if the server had sent it. So every view has its
 * own, the server needs not know which view belongs to which page, and a click can do nothing but tell its own page.
 *
 * To the page:   {hubside: "ready" | "link" | "select" | "places" | "freed", ...}
 * From the page: {hubside: "view", theme, camera, selected, ghosts}
 */
"use strict";
(() => {
  const SCENE = /*SCENE*/ null;
  const EASE_MS = 450;
  const query = new URLSearchParams(location.search);
  const view = {
    theme: query.has("darkMode") ? "dark" : "light",
    camera: query.get("camera"),
    selected: null,
    ghosts: true,
  };

  /** The client reconnects only while its window has the focus, which a docked frame seldom has. */
  Document.prototype.hasFocus = () => true;
  // It also prepares a sorter for point clouds that makes code from text: our policy refuses that, this view needs none.
  addEventListener("unhandledrejection", (event) => event.reason instanceof EvalError && event.preventDefault());

  const cameras = new Map(SCENE.cameras.map((camera) => [camera.name, camera]));
  const chosen = () => cameras.get(view.camera) ?? SCENE.cameras[0];

  // -- vectors: [x, y, z]; quaternions: [w, x, y, z] -------------------------------------------------------------

  const minus = (a, b) => a.map((one, i) => one - b[i]);
  const mix = (a, b, share) => a.map((one, i) => one + (b[i] - one) * share);
  const length = (a) => Math.hypot(...a);
  const dot = (a, b) => a.reduce((sum, one, i) => sum + one * b[i], 0);
  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
  const inverse = ([w, x, y, z]) => [w, -x, -y, -z];

  function turned([w, ...q], v) {
    const t = cross(q, v).map((one) => 2 * one);
    const u = cross(q, t);
    return v.map((one, i) => one + w * t[i] + u[i]);
  }

  // -- the picture's angle of view -------------------------------------------------------------------------------

  function fovOf(camera) {
    const distance = length(minus(camera.position, camera.look_at));
    const half = Math.max(camera.half[1], (camera.half[0] * innerHeight) / Math.max(1, innerWidth));
    return 2 * Math.atan(half / distance);
  }

  // The client takes its first camera from its address.
  const first = chosen();
  query.set("initialCameraPosition", first.position.join(","));
  query.set("initialCameraLookAt", first.look_at.join(","));
  query.set("initialCameraFov", fovOf(first).toFixed(4));
  history.replaceState(null, "", "?" + query);

  // -- the worker ------------------------------------------------------------------------------------------------

  let client = null; // the worker that holds the socket
  let seen = null; // the latest camera that the client told its server
  let rotor = [1, 0, 0, 0];
  let freed = false; // a person has moved the camera since it was chosen
  let flight = 0; // number of the camera's flight under way

  function put(messages) {
    client?.dispatchEvent(new MessageEvent("message", { data: { type: "message_batch", messages } }));
  }

  function tell(kind, more) {
    if (parent !== window) parent.postMessage({ hubside: kind, ...more }, location.origin);
  }

  function onSent(data) {
    if (data?.type !== "send") return;
    const message = data.message;
    if (message.type === "ViewerCameraMessage") {
      seen = message;
      tellPlaces();
    } else if (message.type === "SceneNodeClickMessage") {
      const blade = /\/blade-(\d+)(\/|$)/.exec(message.name)?.[1];
      if (blade) tell("select", { blade: Number(blade) });
    }
  }

  function onCame(data) {
    if (data?.type === "connected" || data?.type === "closed") {
      tell("link", { up: data.type === "connected" });
      return;
    }
    if (data?.type !== "message_batch") return;
    for (const message of data.messages) {
      if (message.type === "SetOrientationMessage" && message.name === SCENE.rotor) {
        rotor = message.wxyz;
        queueMicrotask(follow);
      } else if (message.type === "ReplayDoneMessage") {
        // The scene is whole, or whole again after a lost link: now this view's own can be put in.
        queueMicrotask(() => {
          showNodes();
          if (!freed) place(target());
        });
      }
    }
  }

  window.Worker = new Proxy(window.Worker, {
    construct(Original, args) {
      const worker = Reflect.construct(Original, args);
      const post = worker.postMessage.bind(worker);
      worker.postMessage = (data, ...rest) => {
        if (data?.type === "set_server") {
          client = worker;
          worker.addEventListener("message", (event) => onCame(event.data));
        }
        post(data, ...rest);
        if (worker === client) onSent(data);
      };
      return worker;
    },
  });

  // -- what this view shows --------------------------------------------------------------------------------------

  const visible = (name, shown) => ({ type: "SetSceneNodeVisibilityMessage", name, visible: shown, owner: "" });

  function showNodes() {
    put([
      visible(SCENE.nose, !chosen().nose_off),
      ...SCENE.blades.flatMap(({ blade, selected, demand }) => [
        visible(selected, view.selected === blade),
        visible(demand, view.ghosts),
      ]),
      ...SCENE.ghosts.map((name) => visible(name, view.ghosts)),
    ]);
  }

  /** Where the chosen camera is now: that of a blade goes round with it. */
  function target() {
    const camera = chosen();
    const spin = camera.blade === null ? (point) => point : (point) => turned(rotor, point);
    return { position: spin(camera.position), look_at: spin(camera.look_at), fov: fovOf(camera) };
  }

  function place({ position, look_at, fov }) {
    put([
      { type: "SetCameraPositionMessage", position, initial: false },
      { type: "SetCameraLookAtMessage", look_at, initial: false },
      { type: "SetCameraFovMessage", fov, initial: false },
    ]);
  }

  function fly() {
    freed = false;
    flight += 1;
    const mine = flight;
    if (!seen || matchMedia("(prefers-reduced-motion: reduce)").matches) return place(target());
    const from = { position: seen.position, look_at: seen.look_at, fov: seen.fov };
    const started = performance.now();
    const step = (now) => {
      if (mine !== flight || freed) return;
      const share = Math.min(1, Math.max(0, (now - started) / EASE_MS));
      place(between(from, target(), share * share * (3 - 2 * share)));
      if (share < 1) requestAnimationFrame(step);
      else flight = 0;
    };
    requestAnimationFrame(step);
  }

  /** Round the point looked at, not through what is there. */
  function between(from, to, share) {
    const look_at = mix(from.look_at, to.look_at, share);
    const [away, near] = [minus(from.position, from.look_at), minus(to.position, to.look_at)];
    const direction = mix(away, near, share);
    const reach = (length(away) * (1 - share) + length(near) * share) / Math.max(1e-6, length(direction));
    const position = look_at.map((one, i) => one + direction[i] * reach);
    // The distance changes with the angle of view: what is looked at keeps growing or shrinking evenly.
    const size = Math.exp(Math.log(tan(from.fov)) * (1 - share) + Math.log(tan(to.fov)) * share);
    return { position, look_at, fov: 2 * Math.atan(size) };
  }

  const tan = (fov) => Math.tan(fov / 2);

  /** The rotor has turned. */
  function follow() {
    if (!freed && flight === 0 && chosen().blade !== null) place(target());
    else tellPlaces();
  }

  function free() {
    if (freed) return;
    freed = true;
    tell("freed", {});
  }

  // -- where labels belong ---------------------------------------------------------------------------------------

  let told = "";

  function tellPlaces() {
    if (!seen) return;
    const focal = innerHeight / 2 / tan(seen.fov);
    const back = inverse(seen.wxyz);
    const places = SCENE.places.map(({ id, position, normal, fixed }) => {
      const point = fixed ? position : turned(rotor, position);
      const away = minus(point, seen.position);
      const [x, y, depth] = turned(back, away);
      const faces = normal === null || dot(turned(rotor, normal), away) < 0;
      if (depth <= 0.1) return { id, x: 0, y: 0, faces: false };
      return {
        id,
        x: Math.round(innerWidth / 2 + (focal * x) / depth),
        y: Math.round(innerHeight / 2 + (focal * y) / depth),
        faces,
      };
    });
    const text = JSON.stringify(places);
    if (text === told) return;
    told = text;
    tell("places", { places, width: innerWidth, height: innerHeight });
  }

  // -- the page --------------------------------------------------------------------------------------------------

  function showTheme() {
    document.documentElement.dataset.theme = view.theme;
  }

  addEventListener("message", (event) => {
    if (event.origin !== location.origin || event.source !== parent || event.data?.hubside !== "view") return;
    const before = chosen().name;
    const { theme, camera, selected, ghosts, again } = event.data;
    Object.assign(view, { theme, camera, selected, ghosts });
    showTheme();
    showNodes();
    if (chosen().name !== before || (again && freed)) fly();
    told = "";
    tellPlaces();
  });

  addEventListener("resize", () => {
    if (!freed) place(target());
  });
  for (const kind of ["pointerdown", "wheel"])
    addEventListener(
      kind,
      (event) => {
        let [x, y] = [event.clientX, event.clientY];
        if (kind === "wheel") return free();
        const moved = (move) => {
          if (Math.hypot(move.clientX - x, move.clientY - y) > 4) free();
        };
        addEventListener("pointermove", moved);
        addEventListener("pointerup", () => removeEventListener("pointermove", moved), { once: true });
      },
      { capture: true, passive: true },
    );

  showTheme();
  tell("ready", {});
})();
