// Tools for drawing maps: colours, the transform from the plane to pixels, a surface, a legend.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_CANVAS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_CANVAS_H_

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"

namespace hypermap::cli {

// Margin around the plan, distance between lines of text, and height of the footer below the plan
// for the scale bar. Pixels.
inline constexpr double kMargin = 20.0;
inline constexpr double kLineHeight = 21.0;
inline constexpr double kFooter = 30.0;

// Channels are in [0, 1].
struct Colour {
  double red = 0.0;
  double green = 0.0;
  double blue = 0.0;
};
inline constexpr Colour kBlack{0.1, 0.1, 0.1};

constexpr Colour Grey(double level) { return {level, level, level}; }
// Returns the mixture of `share` of `a` and 1 - `share` of `b`.
Colour Mix(const Colour& a, const Colour& b, double share);

// The colour of a class. It is the same for a label in all pictures, and does not depend on the
// label's spelling (case and blanks).
Colour ColourOfLabel(absl::string_view label);

// Maps a box of the plane to pixels. The upper left corner of the box is one margin away from that
// of the picture; y points up on the plane and down in pixels.
class Plan {
 public:
  // `box` must have an area.
  Plan(const Box& box, double pixels_per_m);
  // The scale at which the longer side of `box` has `longer_side` pixels.
  static double ScaleToFit(const Box& box, double longer_side);

  double width() const { return width_; }
  double height() const { return height_; }
  double pixels_per_m() const { return pixels_per_m_; }
  Point At(const Point& p) const {
    return {kMargin + (p.x - box_.min.x) * pixels_per_m_,
            kMargin + (box_.max.y - p.y) * pixels_per_m_};
  }

 private:
  Box box_;
  double pixels_per_m_;
  double width_;
  double height_;
};

// Rule by which a canvas is combined with the one below it.
enum class Blend {
  kOver,      // hides the lower canvas
  kMultiply,  // darkens the lower canvas
  kMask,      // keeps the lower canvas only where the upper one is opaque
};

// A drawing surface; positions are in pixels. Png returns the first error. Used by one thread.
class Canvas {
 public:
  // Makes a white canvas.
  Canvas(double width, double height);
  ~Canvas();
  // Makes a transparent canvas of the same size.
  static Canvas Layer(const Canvas& below);

  int width() const;
  int height() const;

  void Fill(const Polygon& polygon, const Plan& plan, const Colour& c, double opacity);
  void Outline(const Polygon& polygon, const Plan& plan, const Colour& c, double width,
               bool broken);
  void Line(const Point& from, const Point& to, const Colour& c, double width, bool broken);
  // Draws a line through points of the plane.
  void Path(const std::vector<Point>& points, const Plan& plan, const Colour& c, double width);
  void Cross(const Point& at, double size, const Colour& c, double width = 1.5);
  void Disc(const Point& at, double radius, const Colour& c);
  // A square with its lower left corner at `at`.
  void Square(const Point& at, double size, const Colour& c);
  // `at` is the left end of the base line.
  void Text(const Point& at, const std::string& text);
  double TextWidth(const std::string& text) const;
  // Fills the polygon with these corners and adds its coverage to that of earlier calls, so that
  // adjacent polygons show no seam where they share a pixel. The polygons must not overlap.
  void Add(const Ring& corners, const Plan& plan, const Colour& c, double opacity = 1.0);
  void Lay(const Canvas& upper, Blend blend);

  // Limits drawing to the plan until Unclip.
  void ClipTo(const Plan& plan);
  void Unclip();

  // Returns the picture encoded as PNG.
  absl::StatusOr<std::string> Png() const;

 private:
  struct Drawing;
  explicit Canvas(std::unique_ptr<Drawing> drawing);

  void Trace(const Ring& ring, const Plan& plan);
  void Trace(const Polygon& polygon, const Plan& plan);
  void Stroke(const Colour& c, double width, bool broken);

  const std::unique_ptr<Drawing> drawing_;
};

// Returns the objects in drawing order, largest first, so that a thing on a table is visible.
// `size_of(object)` is the size of an object.
template <typename Object, typename SizeOf>
std::vector<const Object*> LargestFirst(const std::vector<Object>& objects, SizeOf size_of) {
  std::vector<const Object*> sorted;
  for (const Object& object : objects) sorted.push_back(&object);
  std::stable_sort(sorted.begin(), sorted.end(), [&size_of](const Object* a, const Object* b) {
    return size_of(*a) > size_of(*b);
  });
  return sorted;
}

// Draws a line below the plan whose length is a round number of metres.
void DrawScaleBar(Canvas& canvas, const Plan& plan);

// Writes the lines of a legend from top to bottom. The canvas must outlive it. Used by one thread.
class Legend {
 public:
  // Distance of the text from the left, beside a sample.
  static constexpr double kIndent = 28.0;

  Legend(Canvas& canvas, const Point& top_left)
      : canvas_(canvas), x_(top_left.x), y_(top_left.y + kLineHeight) {}

  void Text(const std::string& text);
  void Square(const Colour& c, const std::string& text);
  void Line(const Colour& c, bool broken, const std::string& text);
  void Cross(const Colour& c, const std::string& text);
  // Adds a line with a sample, which `draw` draws with its lower left corner at a given place. It
  // must be narrower than kIndent.
  void Sample(const std::function<void(Canvas& canvas, const Point& at)>& draw,
              const std::string& text);
  void Gap() { y_ += kLineHeight / 2; }

 private:
  // Writes the text beside a sample and moves to the next line.
  void TextBehind(const std::string& text);

  Canvas& canvas_;
  double x_;
  double y_;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_CANVAS_H_
