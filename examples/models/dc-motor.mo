model DcMotor "a motor with a permanent magnet, its current and its speed measured"
  parameter Real R(unit="Ohm", min=0) = 1 "winding";
  parameter Real L(unit="H", min=0) = 0.005 "winding";
  parameter Real K(unit="V.s", min=0) = 0.1 "back EMF for a speed; torque for a current";
  parameter Real J(unit="kg.m2", min=0) = 0.0002 "rotor and load";
  parameter Real b(unit="N.m.s", min=0) = 0.0002 "friction that grows with the speed";
  parameter Real c(unit="N.m", min=0) = 0.02 "friction that does not";
  final parameter Real w0(unit="1/s") = 2 "speed at which the friction turns round";
  input Real u(unit="V") "terminals";
  output Real i(unit="A", start=0) "current";
  output Real w(unit="1/s", start=0) "speed, in radians";
  Real friction(unit="N.m") = b*w + c*tanh(w/w0);
equation
  L*der(i) = u - R*i - K*w;
  J*der(w) = K*i - friction;
end DcMotor;
