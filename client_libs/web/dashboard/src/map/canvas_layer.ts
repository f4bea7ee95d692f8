import type { FrameState } from 'ol/Map';
import Layer from 'ol/layer/Layer';

/** A layer that paints its own content on a canvas as large as the map. */
export abstract class CanvasLayer extends Layer {
  // OpenLayers lets other layers draw into a canvas unless it has an element of its own.
  readonly #element = document.createElement('div');
  readonly #canvas = document.createElement('canvas');

  constructor() {
    super({});
    this.#element.className = 'canvas-layer';
    this.#element.append(this.#canvas);
  }

  override render(frame: FrameState): HTMLElement {
    const [width = 0, height = 0] = frame.size;
    const pixels = {
      width: Math.round(width * frame.pixelRatio),
      height: Math.round(height * frame.pixelRatio),
    };
    const canvas = this.#canvas;
    if (canvas.width !== pixels.width || canvas.height !== pixels.height) {
      Object.assign(canvas, pixels);
      Object.assign(canvas.style, { width: `${width}px`, height: `${height}px` });
    }
    this.#element.style.opacity = String(this.getOpacity());
    const context = canvas.getContext('2d');
    if (context) {
      context.resetTransform();
      context.clearRect(0, 0, canvas.width, canvas.height);
      this.paint(context, frame);
    }
    return this.#element;
  }

  /** Paints the visible content on a cleared canvas. */
  protected abstract paint(context: CanvasRenderingContext2D, frame: FrameState): void;
}
