// Line icons in a box of 20 x 20 units, drawn in the colour of the text.
import type { ComponentChildren } from 'preact';

function Icon({ children }: { children: ComponentChildren }) {
  return (
    <svg
      class="icon"
      viewBox="0 0 20 20"
      fill="none"
      stroke="currentColor"
      stroke-width="1.6"
      stroke-linecap="round"
      stroke-linejoin="round"
      aria-hidden="true"
    >
      {children}
    </svg>
  );
}

export const LayersIcon = () => (
  <Icon>
    <path d="M10 3 2.5 7 10 11l7.5-4zM2.5 10.5 10 14.5l7.5-4M2.5 14 10 18l7.5-4" />
  </Icon>
);

export const SearchIcon = () => (
  <Icon>
    <circle cx="8.5" cy="8.5" r="5.5" />
    <path d="m13 13 4.5 4.5" />
  </Icon>
);

export const InfoIcon = () => (
  <Icon>
    <circle cx="10" cy="10" r="7.5" />
    <path d="M10 9v5M10 6.2v.1" />
  </Icon>
);

export const EditIcon = () => (
  <Icon>
    <path d="m3 17 .8-3.5L13.6 3.7a1.6 1.6 0 0 1 2.3 0l.4.4a1.6 1.6 0 0 1 0 2.3L6.5 16.2zM12 5.5 14.5 8" />
  </Icon>
);

export const ChangesIcon = () => (
  <Icon>
    <path d="M2 10h3.5L8 4l4 12 2.5-6H18" />
  </Icon>
);

export const ExploreIcon = () => (
  <Icon>
    <circle cx="10" cy="10" r="7.5" />
    <path d="m13.5 6.5-2 5-5 2 2-5z" />
  </Icon>
);

export const AlignIcon = () => (
  <Icon>
    <path d="M3 3h9v9H3zM10.5 5.5l7 4-4 7-7-4" />
  </Icon>
);

export const ExportIcon = () => (
  <Icon>
    <path d="M10 3v10m-4-4 4 4 4-4M3 16.5h14" />
  </Icon>
);

export const TimeIcon = () => (
  <Icon>
    <circle cx="10" cy="10" r="7.5" />
    <path d="M10 5.5V10l3 2" />
  </Icon>
);

export const EyeIcon = () => (
  <Icon>
    <path d="M1.8 10S5 4.5 10 4.5 18.2 10 18.2 10 15 15.5 10 15.5 1.8 10 1.8 10z" />
    <circle cx="10" cy="10" r="2.6" />
  </Icon>
);

export const CloseIcon = () => (
  <Icon>
    <path d="m5 5 10 10M15 5 5 15" />
  </Icon>
);

export const BackIcon = () => (
  <Icon>
    <path d="m12.5 4-6 6 6 6" />
  </Icon>
);

export const ForwardIcon = () => (
  <Icon>
    <path d="m7.5 4 6 6-6 6" />
  </Icon>
);

export const FitIcon = () => (
  <Icon>
    <path d="M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4" />
  </Icon>
);

export const PlusIcon = () => (
  <Icon>
    <path d="M10 4v12M4 10h12" />
  </Icon>
);

export const MinusIcon = () => (
  <Icon>
    <path d="M4 10h12" />
  </Icon>
);

export const ChevronIcon = () => (
  <Icon>
    <path d="m5 8 5 5 5-5" />
  </Icon>
);
