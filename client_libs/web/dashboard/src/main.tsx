// The theme comes first, because map/scale.ts reads its root font size when it is loaded.
import './app/theme.css';
import { render } from 'preact';
import { App } from './app/app';
import { startAlign } from './state/align';
import { startCaller } from './state/caller';
import { startEdits } from './state/edits';
import { start } from './state/live';
import { startQuestions } from './state/questions';
import { startRobots } from './state/robots';
import { startShowing } from './state/show_map';
import { startTime } from './state/time';
import { startUrl } from './state/url';

startUrl();
startTime();
startShowing();
start();
startCaller();
startEdits();
startQuestions();
startAlign();
startRobots();

const root = document.getElementById('app');
if (root) render(<App />, root);
