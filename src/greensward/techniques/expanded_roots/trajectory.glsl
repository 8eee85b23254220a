// The middle line of a blade: the trajectory of a particle (Tillman 2013, section 2.1.2 and figure 19).

// At a time after the launch, in the plane of the flight: x along the ground, y up
vec2 particleAt(float speed, float angle, float gravity, float time) {
    return vec2(speed * cos(angle) * time, speed * sin(angle) * time - 0.5 * gravity * time * time);
}

// Along the straight lines between the points at even intervals
float flightLength(float speed, float angle, float gravity, float interval, int intervals) {
    vec2 last = vec2(0.0);
    float sum = 0.0;
    for (int i = 1; i <= intervals; i++) {
        vec2 next = particleAt(speed, angle, gravity, float(i) * interval);
        sum += distance(last, next);
        last = next;
    }
    return sum;
}

// Linear from the root, at point 0, to the last point below the tip
float widthAt(int point, int last, float root, float top) { return last > 0 ? mix(root, top, float(point) / float(last)) : root; }
