// A page that shows a map as programs do that speak Foxglove's protocol: it knows the messages of
// the protocol only, which it gets with Foxglove's own client from the gateway that serves the page.
// The parameters of its address are the `map`, the name of the protocol as `subprotocol`, and as
// `hidden` the topics that are received but not drawn, with commas between them.
import {
  LineType,
  type Color,
  type FrameTransforms,
  type LinePrimitive,
  type Pose,
  type SceneUpdate,
} from '@foxglove/schemas';
import {
  FoxgloveClient,
  type Channel,
  type IWebSocket,
  type MessageData,
} from '@foxglove/ws-protocol';

import type { GridMessage } from '../../support/content.js';

/** The newest message of each topic, and what the gateway complained about. */
export interface Received {
  grids: Record<string, GridMessage>;
  scenes: Record<string, SceneUpdate>;
  transforms?: FrameTransforms;
  problems: string[];
}

const GRID = 'foxglove.Grid';
const SCENE = 'foxglove.SceneUpdate';
const MARGIN_PIXELS = 40;
const AXIS_PIXELS = 36;
const FONT = '600 12px system-ui, sans-serif';

const params = new URL(location.href).searchParams;
const hidden = new Set(params.get('hidden')?.split(','));
const received: Received = { grids: {}, scenes: {}, problems: [] };
Object.assign(window, { received });

function connect(): void {
  const url = `${location.origin.replace('http', 'ws')}/foxglove/${params.get('map')}`;
  const ws = new WebSocket(url, [params.get('subprotocol') ?? '']);
  // The types differ in kinds of buffers that the client does not send.
  const client = new FoxgloveClient({ ws: ws as unknown as IWebSocket });
  const channels = new Map<number, Channel>();
  client.on('advertise', (advertised) => {
    for (const channel of advertised) channels.set(client.subscribe(channel.id), channel);
  });
  client.on('message', ({ subscriptionId, data }: MessageData) => {
    const channel = channels.get(subscriptionId);
    if (channel) keep(channel, new TextDecoder().decode(data));
    requestAnimationFrame(draw);
  });
  client.on('status', ({ message }) => received.problems.push(message));
  client.on('error', (error) => received.problems.push(String(error)));
}

function keep({ topic, schemaName }: Channel, text: string): void {
  if (schemaName === GRID) received.grids[topic] = JSON.parse(text) as GridMessage;
  else if (schemaName === SCENE) received.scenes[topic] = JSON.parse(text) as SceneUpdate;
  else received.transforms = JSON.parse(text) as FrameTransforms;
}

/** The messages of the topics that are drawn, the topics in alphabetical order. */
function drawn<T>(messages: Record<string, T>): T[] {
  const topics = Object.keys(messages).filter((topic) => !hidden.has(topic));
  return topics.sort().flatMap((topic) => messages[topic] ?? []);
}

const yawOf = ({ orientation: { z, w } }: Pose): number => 2 * Math.atan2(z, w);

/** The cells of a grid as an image, whose first row is that of the smallest y. */
function imageOf(grid: GridMessage): HTMLCanvasElement {
  const bytes = Uint8Array.from(atob(grid.data), (letter) => letter.charCodeAt(0));
  const [columns, rows] = [grid.column_count, bytes.length / grid.row_stride];
  const image = new ImageData(columns, rows);
  const offsets = ['red', 'green', 'blue', 'alpha'].map(
    (part) => grid.fields.find(({ name }) => name === part)?.offset ?? NaN,
  );
  for (let cell = 0; cell < columns * rows; cell++) {
    const row = Math.floor(cell / columns);
    const begin = row * grid.row_stride + (cell % columns) * grid.cell_stride;
    image.data.set(
      offsets.map((offset) => bytes[begin + offset] ?? 0),
      4 * cell,
    );
  }
  const canvas = Object.assign(document.createElement('canvas'), { width: columns, height: rows });
  canvas.getContext('2d')?.putImageData(image, 0, 0);
  return canvas;
}

type Place = [x: number, y: number];

/** The corners of all that is drawn, in the map's frame. */
function places(): Place[] {
  const ofGrids = drawn(received.grids).flatMap(({ pose, column_count, cell_size, ...grid }) => {
    const rows = (grid.data.length * 3) / 4 / grid.row_stride;
    const [width, height] = [column_count * cell_size.x, rows * cell_size.y];
    const [cos, sin] = [Math.cos(yawOf(pose)), Math.sin(yawOf(pose))];
    const { x, y } = pose.position;
    const corners: Place[] = [
      [0, 0],
      [width, 0],
      [width, height],
      [0, height],
    ];
    return corners.map(([a, b]): Place => [x + cos * a - sin * b, y + sin * a + cos * b]);
  });
  const entities = drawn(received.scenes).flatMap((scene) => scene.entities);
  const ofLines = entities.flatMap(({ lines }) =>
    lines.flatMap(({ points }) => points.map(({ x, y }): Place => [x, y])),
  );
  return [...ofGrids, ...ofLines];
}

/** Draws in the map's frame on a canvas of the size of the window. */
class Drawing {
  readonly #context: CanvasRenderingContext2D;
  readonly #scale: number;
  readonly #origin: Place;
  readonly #taken: DOMRect[] = [];

  constructor(canvas: HTMLCanvasElement, corners: readonly Place[]) {
    const context = canvas.getContext('2d');
    if (!context) throw new Error('the browser has no canvas');
    this.#context = context;
    const [width, height] = [innerWidth, innerHeight];
    Object.assign(canvas, { width, height });
    const [xs, ys] = [corners.map(([x]) => x), corners.map(([, y]) => y)];
    const [left, right] = [Math.min(...xs), Math.max(...xs)];
    const [low, high] = [Math.min(...ys), Math.max(...ys)];
    this.#scale = Math.min(
      (width - 2 * MARGIN_PIXELS) / (right - left),
      (height - 2 * MARGIN_PIXELS) / (high - low),
    );
    this.#origin = [
      width / 2 - (this.#scale * (left + right)) / 2,
      height / 2 + (this.#scale * (low + high)) / 2,
    ];
  }

  at([x, y]: Place): Place {
    return [this.#origin[0] + this.#scale * x, this.#origin[1] - this.#scale * y];
  }

  grid(grid: GridMessage): void {
    const context = this.#context;
    const { position } = grid.pose;
    context.save();
    context.imageSmoothingEnabled = false;
    context.translate(...this.at([position.x, position.y]));
    context.rotate(-yawOf(grid.pose));
    context.scale(this.#scale * grid.cell_size.x, -this.#scale * grid.cell_size.y);
    context.drawImage(imageOf(grid), 0, 0);
    context.restore();
  }

  entity({ triangles, lines, spheres }: SceneUpdate['entities'][number]): void {
    for (const { points, indices, color } of triangles) {
      const corners = indices.flatMap((index) => points[index] ?? []);
      for (let i = 0; i < corners.length; i += 3) {
        this.#fill(this.#path(corners.slice(i, i + 3)), color);
      }
    }
    for (const line of lines) this.#line(line);
    for (const { pose, size, color } of spheres) {
      const path = new Path2D();
      const { x, y } = pose.position;
      path.arc(...this.at([x, y]), (this.#scale * size.x) / 2, 0, 2 * Math.PI);
      this.#fill(path, color);
    }
  }

  /** Writes a text unless it would lie over an earlier one. */
  label(text: string, place: Place, color: Color): void {
    const context = this.#context;
    context.font = FONT;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    const [x, y] = this.at(place);
    const width = context.measureText(text).width + 4;
    const box = new DOMRect(x - width / 2, y - 8, width, 16);
    const isOver = (other: DOMRect) =>
      box.left < other.right &&
      other.left < box.right &&
      box.top < other.bottom &&
      other.top < box.bottom;
    if (this.#taken.some(isOver)) return;
    this.#taken.push(box);
    context.lineWidth = 4;
    context.lineJoin = 'round';
    context.strokeStyle = 'white';
    context.strokeText(text, x, y);
    context.fillStyle = css(color);
    context.fillText(text, x, y);
  }

  /** Draws the axes of a frame, x red and y green, with the name of the frame. */
  axes(name: string, { x, y, yaw }: Frame): void {
    const context = this.#context;
    const [left, top] = this.at([x, y]);
    for (const [angle, colour] of [
      [yaw, '#d00000'],
      [yaw + Math.PI / 2, '#008000'],
    ] as const) {
      context.beginPath();
      context.moveTo(left, top);
      context.lineTo(left + AXIS_PIXELS * Math.cos(angle), top - AXIS_PIXELS * Math.sin(angle));
      context.lineWidth = 3;
      context.strokeStyle = colour;
      context.stroke();
    }
    this.label(name, [x, y - 12 / this.#scale], { r: 0, g: 0, b: 0, a: 1 });
  }

  /** Draws a line of one metre in the lower left corner. */
  metre(): void {
    const context = this.#context;
    const y = innerHeight - MARGIN_PIXELS / 2;
    context.fillStyle = 'black';
    context.fillRect(MARGIN_PIXELS, y, this.#scale, 3);
    context.textAlign = 'left';
    context.textBaseline = 'bottom';
    context.font = FONT;
    context.fillText('1 m', MARGIN_PIXELS, y - 2);
  }

  #line({ type, points, color, thickness }: LinePrimitive): void {
    const path = this.#path(points);
    if (type === LineType.LINE_LOOP) path.closePath();
    this.#context.lineWidth = thickness;
    this.#context.lineJoin = 'round';
    this.#context.strokeStyle = css(color);
    this.#context.stroke(path);
  }

  #path(points: readonly { x: number; y: number }[]): Path2D {
    const path = new Path2D();
    for (const { x, y } of points) path.lineTo(...this.at([x, y]));
    return path;
  }

  #fill(path: Path2D, color: Color): void {
    this.#context.fillStyle = css(color);
    this.#context.fill(path);
  }
}

function css({ r, g, b, a }: Color): string {
  return `rgba(${255 * r}, ${255 * g}, ${255 * b}, ${a})`;
}

interface Frame {
  x: number;
  y: number;
  yaw: number;
}

/** The pose of each frame in the root of the tree. */
function frames({ transforms }: FrameTransforms): Map<string, Frame> {
  const children = new Set(transforms.map((edge) => edge.child_frame_id));
  const found = new Map<string, Frame>();
  for (const { parent_frame_id: name } of transforms) {
    if (!children.has(name)) found.set(name, { x: 0, y: 0, yaw: 0 });
  }
  // An edge may come before the one that leads to its parent.
  for (let before = -1; before < found.size;) {
    before = found.size;
    for (const { parent_frame_id, child_frame_id, translation, rotation } of transforms) {
      const parent = found.get(parent_frame_id);
      if (!parent) continue;
      const [cos, sin] = [Math.cos(parent.yaw), Math.sin(parent.yaw)];
      found.set(child_frame_id, {
        x: parent.x + cos * translation.x - sin * translation.y,
        y: parent.y + sin * translation.x + cos * translation.y,
        yaw: parent.yaw + 2 * Math.atan2(rotation.z, rotation.w),
      });
    }
  }
  return found;
}

function draw(): void {
  const canvas = document.querySelector('canvas');
  const corners = places();
  if (!canvas || corners.length === 0) return;
  const drawing = new Drawing(canvas, corners);
  for (const grid of drawn(received.grids)) drawing.grid(grid);
  const entities = drawn(received.scenes).flatMap((scene) => scene.entities);
  for (const entity of entities) drawing.entity(entity);
  const tree = received.transforms ? frames(received.transforms) : new Map<string, Frame>();
  for (const [name, frame] of tree) drawing.axes(name, frame);
  for (const { texts } of entities) {
    for (const { text, pose, color } of texts) {
      drawing.label(text, [pose.position.x, pose.position.y], color);
    }
  }
  drawing.metre();
}

connect();
