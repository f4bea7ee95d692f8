import Icon from 'ol/style/Icon';
import Fill from 'ol/style/Fill';
import Stroke from 'ol/style/Stroke';
import Style from 'ol/style/Style';
import Text from 'ol/style/Text';
import type { PlacedRobot } from '../state/robots';
import type { Look } from './look';

/** The distance from the centre of a marker to its tip, pixels before scaling for large screens. */
const RADIUS = 13;
const BORDER = 2.5;

/** `faint` is the text of robots that are offline. */
const LIGHT = {
  online: '#2560c9',
  offline: '#7b8794',
  ground: '#ffffff',
  text: '#1b2430',
  faint: '#576475',
};
const DARK = {
  online: '#7fb0ff',
  offline: '#8b97a6',
  ground: '#0f1318',
  text: '#e7ecf2',
  faint: '#9fadbd',
};

/** An arrow that points up, as the image of an icon. */
function arrow(colour: string, ground: string, scale: number): HTMLCanvasElement {
  const radius = RADIUS * scale;
  const side = Math.ceil(2 * (radius + BORDER * scale));
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = side;
  const context = canvas.getContext('2d');
  if (!context) return canvas;
  context.translate(side / 2, side / 2);
  context.beginPath();
  context.moveTo(0, -radius);
  context.lineTo(0.75 * radius, 0.8 * radius);
  context.lineTo(0, 0.4 * radius);
  context.lineTo(-0.75 * radius, 0.8 * radius);
  context.closePath();
  context.lineJoin = 'round';
  context.lineWidth = BORDER * scale;
  context.strokeStyle = ground;
  context.fillStyle = colour;
  context.fill();
  context.stroke();
  return canvas;
}

/** Draws a robot as an arrow that points where the robot looks, with its name and its age. */
export function robotStyle({ dark, scale }: Look): (robot: PlacedRobot, age: string) => Style {
  const { online, offline, ground, text, faint } = dark ? DARK : LIGHT;
  const images = { online: arrow(online, ground, scale), offline: arrow(offline, ground, scale) };
  return (robot, age) => {
    // Icons turn clockwise, and the arrow points along the y axis.
    // Labels make way for arrows, which are always drawn.
    const image = new Icon({
      declutterMode: 'obstacle',
      img: robot.online ? images.online : images.offline,
      rotation: Math.PI / 2 - robot.yaw,
    });
    const label = new Text({
      text: [
        robot.name,
        `600 ${13 * scale}px system-ui, sans-serif`,
        ` ${age}`,
        `${11 * scale}px system-ui, sans-serif`,
      ],
      offsetY: 24 * scale,
      fill: new Fill({ color: robot.online ? text : faint }),
      stroke: new Stroke({ color: ground, width: 4 * scale }),
    });
    return new Style({ image, text: label });
  };
}
