"""Recordings of a session: pictures of any size, a video, and a camera path with its playback."""

from pathlib import Path

from greensward.io.camera_path import CameraPath
from greensward.io.rasters import PICTURES
from greensward.io.video import check_video, find_ffmpeg
from greensward.scene import Camera, GreenswardError, InputError
from greensward.scene.files import check_writable
from greensward.viewer.jobs import VIDEO_FPS, PathRecording, PictureJob, VideoJob
from greensward.viewer.saving import free_name
from greensward.viewer.session import Session
from greensward.viewer.viewport import Viewport

_LONGEST_STEP_S = 0.25


class Recorder:
    """Renderings and recordings in progress, of a session."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._pictures: list[PictureJob] = []
        self._video: VideoJob | None = None
        self._recording: PathRecording | None = None
        self._recorded: CameraPath | None = None
        self._playback_s: float | None = None

    @property
    def folder(self) -> Path:
        """Folder for new files: that of the scene file."""
        file = self._session.origin.file
        return file.parent if file else Path()

    @property
    def recording_video(self) -> bool:
        """True while a video is recorded, during which the size of the picture stays."""
        return self._video is not None

    @property
    def recording_path(self) -> bool:
        """True while a camera path is recorded."""
        return self._recording is not None

    def free_name(self, suffix: str) -> Path:
        """Return the name of a file that neither exists nor is being rendered."""
        return free_name(self.folder, self._session.origin.name, suffix, [job.path for job in self._pictures])

    def render(self, camera: Camera, path: Path, size: tuple[int, int], samples: int) -> bool:
        """Start rendering a picture of the current time; return True if the file can be written."""
        session = self._session
        try:
            check_writable(path, tuple(PICTURES))
            if any(job.path == path for job in self._pictures):
                raise InputError(f"{path}: is being rendered; wait for it, or choose another name")
        except GreenswardError as error:
            session.notify(str(error), error=True)
            return False
        self._pictures.append(PictureJob(session.scene, camera, session.clock.time_s, path, size, samples))
        return True

    def toggle_path(self) -> None:
        """Start recording the camera path, or stop and write it."""
        if self._recording is None:
            self._recording = PathRecording()
            return
        stations = self._recording.stations
        if len(stations) < 2:
            self._recording = None
            return
        path = free_name(self.folder, f"{self._session.origin.name}-path", ".toml")
        try:
            self._recorded = CameraPath.recorded(stations)
            self._recorded.write(path)
        except GreenswardError as error:
            self._session.notify(f"{error}; the recording of the camera path goes on", error=True)
        else:
            self._recording = None
            self._session.notify(f"Saved {path}. F7 plays it; `greensward animate --camera-path` renders a clip")

    def toggle_playback(self) -> None:
        """Start or stop moving the camera along the recorded path."""
        if self._recorded is None:
            self._session.notify("Record a camera path first: F5")
            return
        self._playback_s = None if self._playback_s is not None else 0.0

    def play(self, seconds: float) -> None:
        """Advance the playback, if there is one."""
        if self._recorded is None or self._playback_s is None:
            return
        self._playback_s += min(seconds, _LONGEST_STEP_S)
        self._session.controller.set_camera(self._recorded.at(self._playback_s, self._session.scene.camera))
        if self._playback_s > self._recorded.end_s:
            self._playback_s = None

    def toggle_video(self, viewport: Viewport) -> None:
        """Start or stop recording a video of a viewport."""
        if self._video is not None:
            self._stop_video()
            return
        if viewport.picture is None:
            return
        width, height = viewport.picture[1]
        size = max(width // 2 * 2, 2), max(height // 2 * 2, 2)  # encoders want even edges
        path = self.free_name(".mp4")
        try:
            find_ffmpeg()
            check_video(path, size, VIDEO_FPS, None)
            self._video = VideoJob(path, size)
        except GreenswardError as error:
            self._session.notify(str(error), error=True)

    def _stop_video(self) -> None:
        video, self._video = self._video, None
        assert video
        try:
            video.finish()
        except GreenswardError as error:
            self._session.notify(str(error), error=True)
        else:
            self._session.notify(f"Saved {video.path}, {video.seconds:.1f} s")

    def add(self, camera: Camera, viewport: Viewport, seconds: float) -> None:
        """Add a frame, drawn after this many seconds, to the recordings, and report pictures that are complete."""
        if self._recording is not None:
            self._recording.add(camera, seconds)
        if self._video is not None:
            try:
                self._video.add(viewport.read, seconds)
            except GreenswardError as error:
                self._session.notify(str(error), error=True)
                self._video.cancel()
                self._video = None
        for job in [job for job in self._pictures if not job.running]:
            self._pictures.remove(job)
            self._session.notify(job.problem or f"Saved {job.path}", error=job.problem is not None)

    @property
    def progress(self) -> list[str]:
        """Lines about the renderings and recordings in progress."""
        lines = [f"{job.path.name}: {job.done} of {job.total} samples" for job in self._pictures]
        if self._video is not None:
            lines.append(f"Recording a video, {self._video.seconds:.0f} s. F6 stops")
        if self._recording is not None:
            lines.append(f"Recording the camera path, {self._recording.seconds:.0f} s. F5 stops")
        return lines

    @property
    def would_be_lost(self) -> list[str]:
        """Sentences about the work that leaving now would lose."""
        lines = [f"{job.path.name} is still being rendered." for job in self._pictures]
        lines += ["The recorded camera path is not saved."] if self._recording else []
        return lines + (["The recording of the video ends here."] if self._video else [])

    def stop(self) -> None:
        """Cancel pictures, which then leave no file, and complete the video."""
        for job in self._pictures:
            job.cancel()
        if self._video is not None:
            self._stop_video()
