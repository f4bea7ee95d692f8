// First: what is drawn by hand is as large as the page's letters.
import './app/theme.css';
import { render } from 'preact';
import { App } from './app/app';
import { startEdits } from './state/edits';
import { start } from './state/live';
import { startQuestions } from './state/questions';
import { startTime } from './state/time';
import { startUrl } from './state/url';

startUrl();
startTime();
start();
startEdits();
startQuestions();

const root = document.getElementById('app');
if (root) render(<App />, root);
